// Outlines, boxes, paths and numbers, drawn on the picture.

const rowAt = (object, sample) => {
  // The last row of the object at or before a sample, or one before its first.
  let low = object.from, high = object.to;
  while (low < high) { const mid = (low + high) >> 1; if (columns.sample[mid] <= sample) low = mid + 1; else high = mid; }
  return low - 1;
};
const between = (column, row, share) =>
  share ? column[row] * (1 - share) + column[row + 1] * share : column[row];
const lookUp = (object, sample) => {
  // Row and share of the next one; null where the object is not in sight.
  const row = rowAt(object, Math.floor(sample + 1e-6));
  if (row < object.from) return null;
  const gap = row + 1 < object.to ? columns.sample[row + 1] - columns.sample[row] : 0;
  const past = Math.max(0, sample - columns.sample[row]);
  if (gap === 1) return [row, Math.min(past, 1)];
  return past < 1 ? [row, 0] : null;
};
const outlinePath = (row, share) => {
  const x = between(columns.x, row, share) / half, y = between(columns.y, row, share) / half, path = new Path2D();
  const corner = index => {
    const angle = 2 * Math.PI * index / directions;
    const near = columns.shape[row * directions + index] * columns.reach[row];
    const next = share ? columns.shape[(row + 1) * directions + index] * columns.reach[row + 1] : 0;
    const far = (near * (1 - share) + next * share) / 254 / data.grid;
    return [x + far * Math.cos(angle), y + far * Math.sin(angle)];
  };
  for (let k = 0; k < directions; k++) path.lineTo(...corner(k));
  path.closePath();
  return path;
};
const inkOn = colour => {
  const [r, g, b] = [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16));
  return 0.299 * r + 0.587 * g + 0.114 * b > 110 ? "#101214" : "#fafafa";
};
let chosen = objects.length ? objects[0].number : null;
const draw = time => {
  const scale = Math.min(window.devicePixelRatio || 1, 2), box = stage.getBoundingClientRect();
  const width = Math.round(box.width * scale), height = Math.round(box.height * scale);
  if (drawing.width !== width || drawing.height !== height) { drawing.width = width; drawing.height = height; }
  const pen = drawing.getContext("2d"), unit = width / data.width, rise = height / data.height;
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, width, height);
  // Pixel centres are whole numbers: the picture begins half a pixel before 0.
  pen.setTransform(unit, 0, 0, rise, unit / 2, rise / 2);
  const thin = scale / unit, sample = Math.floor(time * data.fps + 1e-6) / data.every;
  for (const object of objects) {
    if (!object.shown) continue;
    const found = lookUp(object, sample);
    if (!found) continue;
    const [row, share] = found, strong = object.number === chosen ? 1.6 : 1;
    const [left, top, right, bottom] = ["left", "top", "right", "bottom"].map(side => between(columns[side], row, share) / half);
    pen.strokeStyle = pen.fillStyle = object.colour;
    pen.lineWidth = 2 * thin * strong;
    pen.lineJoin = "round";
    if ($("paths").checked) drawPath(pen, object, row);
    if ($("outlines").checked) {
      const path = outlinePath(row, share);
      pen.globalAlpha = 0.22; pen.fill(path); pen.globalAlpha = 1; pen.stroke(path);
    }
    if ($("boxes").checked) pen.strokeRect(left, top, right - left, bottom - top);
    drawNumber(pen, object, (left + right) / 2, top, thin);
  }
};
const drawPath = (pen, object, row) => {
  const back = Math.max(object.from, row - Math.round(1.5 * data.fps / data.every));
  pen.beginPath();
  for (let k = back; k <= row; k++) {
    pen.lineTo((columns.left[k] + columns.right[k]) / 2 / half, (columns.top[k] + columns.bottom[k]) / 2 / half);
  }
  pen.stroke();
};
const drawNumber = (pen, object, x, y, thin) => {
  const text = String(object.number), size = 13 * thin, wide = (8 * text.length + 9) * thin, high = 17 * thin;
  const left = Math.min(Math.max(x - wide / 2, 0), data.width - wide), top = Math.max(y - high - 3 * thin, 0);
  pen.beginPath(); pen.roundRect(left, top, wide, high, 4 * thin); pen.fill();
  pen.fillStyle = inkOn(object.colour);
  pen.font = `bold ${size}px system-ui, sans-serif`; pen.textAlign = "center"; pen.textBaseline = "middle";
  pen.fillText(text, left + wide / 2, top + high / 2 + 0.5 * thin);
};
