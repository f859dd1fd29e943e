"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = id => document.getElementById(id);
  const make = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const unpack = (text, Kind) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Kind(bytes.buffer);
  };
  const nothing = {u1: 255, u2: 65535, i2: 32767};

  // ---- Columns of numbers, one row for an object and a sample of time; an object's rows lie together. ----
  const kinds = {
    sample: Uint32Array, left: Int16Array, top: Int16Array, right: Int16Array, bottom: Int16Array,
    growth: Int16Array, contact: Uint16Array, sure: Uint8Array,
    x: Int16Array, y: Int16Array, reach: Uint16Array, shape: Uint8Array,
  };
  const columns = {};
  for (const name in kinds) columns[name] = unpack(data.columns[name], kinds[name]);
  const directions = columns.x.length ? columns.shape.length / columns.x.length : 0;
  const half = data.grid / 2;
  const duration = data.frames / data.fps;
  const objects = data.objects;
  const byNumber = new Map(objects.map(object => [object.number, object]));
  let place = 0;
  for (const object of objects) {
    object.from = place;
    place += object.rows;
    object.to = place;
    object.seen = object.last - object.first;
    object.shown = true;
  }

  const clockText = seconds => {
    const hundredths = Math.max(0, Math.round(seconds * 100)), whole = Math.floor(hundredths / 100);
    const two = number => String(number).padStart(2, "0");
    const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
    const tail = `${two(whole % 60)}.${two(hundredths % 100)}`;
    return hours ? `${hours}:${two(minutes)}:${tail}` : `${minutes}:${tail}`;
  };
  const inputTime = seconds => data.start + seconds;
  const outputTime = seconds => seconds - data.start;

  // ---- The player: the video, or a clock where there is none. ----
  class Clock extends EventTarget {
    constructor() { super(); this.paused = true; this.playbackRate = 1; this.at = 0; }
    get currentTime() { return this.at; }
    set currentTime(time) { this.at = Math.min(Math.max(time, 0), duration); this.tell("seeked"); }
    tell(name) { this.dispatchEvent(new Event(name)); }
    play() {
      this.paused = false; this.tell("play");
      let before = performance.now();
      const step = now => {
        if (this.paused) return;
        this.at += (now - before) / 1000 * this.playbackRate; before = now;
        if (this.at >= duration) { this.at = duration; this.pause(); return; }
        this.tell("timeupdate"); requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
      return Promise.resolve();
    }
    pause() { this.paused = true; this.tell("pause"); }
  }
  const video = $("video"), player = video || new Clock();
  const stage = $("stage"), drawing = $("drawing");
  const ratio = data.width * data.aspect / data.height;
  stage.style.aspectRatio = String(ratio);
  stage.style.maxWidth = `calc(70vh * ${ratio})`;
  if (video) {
    video.removeAttribute("controls");
    video.addEventListener("error", () => {
      stage.after(make("p", {className: "help", role: "alert",
        textContent: "The video cannot be played; keep the file that was written beside this page in the same folder."}));
    });
  }
  const seek = seconds => {
    // The middle of a picture: at its very beginning, rounding may show the one before.
    const frame = Math.min(Math.max(Math.floor(seconds * data.fps + 1e-6), 0), data.frames - 1);
    player.currentTime = (frame + 0.5) / data.fps;
    show();
  };
  const step = pictures => { player.pause(); seek((Math.floor(player.currentTime * data.fps + 1e-6) + pictures) / data.fps); };
  const toggle = () => { if (player.paused) player.play().catch(() => {}); else player.pause(); };

  // ---- Drawing on the picture. ----
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

  // ---- Timeline. ----
  const timeline = $("timeline"), lanes = $("lanes");
  const percent = seconds => `${100 * Math.min(Math.max(seconds / duration, 0), 1)}%`;
  const laneOf = [];
  for (const object of objects) {
    let lane = laneOf.findIndex(end => end < object.first);
    if (lane < 0) lane = laneOf.length;
    laneOf[lane] = object.last + 0.004 * duration;
    object.lane = lane;
  }
  const laneHeight = laneOf.length > 8 ? 12 : 20;
  lanes.style.height = `${Math.max(1, laneOf.length) * laneHeight}px`;
  for (const object of objects) {
    const first = outputTime(object.first), last = outputTime(object.last) + 1 / data.fps;
    const bar = make("div", {className: "object", textContent: object.seen > 0.02 * duration ? String(object.number) : "",
      title: `Object ${object.number}: ${clockText(object.first)} to ${clockText(object.last)}`});
    Object.assign(bar.style, {left: percent(first), width: percent(last - first), top: `${object.lane * laneHeight + 1}px`,
      height: `${laneHeight - 2}px`, background: object.colour, color: inkOn(object.colour)});
    bar.dataset.number = object.number;
    object.bar = bar;
    lanes.append(bar);
    for (const [time, , words] of object.events) {
      const dot = make("div", {className: "event", title: `${clockText(time)} ${words}`});
      Object.assign(dot.style, {left: percent(outputTime(time)), top: `${object.lane * laneHeight + laneHeight / 2 - 3.5}px`});
      lanes.append(dot);
    }
  }
  const niceStep = (span, most) => {
    const rough = span / most, ten = 10 ** Math.floor(Math.log10(rough || 1));
    return [1, 2, 5, 10].map(factor => factor * ten).find(step => step >= rough);
  };
  const timeSteps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600];
  const timeStep = (span, most) => timeSteps.find(step => step >= span / most) || niceStep(span, most);
  const shortTime = (seconds, every) => every < 1 ? clockText(seconds) : clockText(seconds).slice(0, -3);
  const labelTimeline = () => {
    const every = timeStep(duration, Math.max(2, timeline.clientWidth / 90));
    $("marks").replaceChildren();
    for (let time = Math.ceil(data.start / every) * every; time < data.start + duration * 0.97; time += every) {
      const mark = make("span", {textContent: shortTime(time, every)});
      mark.style.left = percent(outputTime(time));
      $("marks").append(mark);
    }
  };
  timeline.setAttribute("aria-valuemin", "0");
  timeline.setAttribute("aria-valuemax", duration.toFixed(2));
  const timeAt = event => {
    const box = timeline.getBoundingClientRect();
    return Math.min(Math.max((event.clientX - box.left) / timeline.clientWidth, 0), 1) * duration;
  };
  let dragging = false;
  timeline.addEventListener("pointerdown", event => {
    if (event.button || event.clientX > timeline.getBoundingClientRect().left + timeline.clientWidth) return;
    dragging = event.pointerType === "mouse";
    if (dragging) timeline.setPointerCapture(event.pointerId);
    if (event.target.dataset.number) choose(Number(event.target.dataset.number));
    seek(timeAt(event));
  });
  timeline.addEventListener("pointermove", event => { if (dragging) seek(timeAt(event)); });
  for (const name of ["pointerup", "pointercancel"]) timeline.addEventListener(name, () => { dragging = false; });

  // ---- Table. ----
  const body = $("objects").tBodies[0];
  const jumpTo = (seconds, label) => {
    const button = make("button", {type: "button", className: "jump", textContent: clockText(seconds)});
    button.setAttribute("aria-label", `${label} ${clockText(seconds)}, jump there`);
    button.addEventListener("click", () => seek(outputTime(seconds)));
    return button;
  };
  for (const object of objects) {
    const show = make("input", {type: "checkbox", checked: true});
    show.setAttribute("aria-label", `Show object ${object.number} in the picture`);
    show.addEventListener("change", () => { setShown(object, show.checked); refreshAll(); draw(player.currentTime); });
    object.box = show;
    const swatch = make("span", {className: "swatch"});
    swatch.style.background = object.colour;
    const pick = make("button", {type: "button", title: "Show how it moves below"}, swatch, String(object.number));
    pick.setAttribute("aria-label", `Object ${object.number}, choose it`);
    pick.addEventListener("click", () => choose(object.number));
    object.pick = pick;
    const picture = object.picture ? make("img", {src: object.picture, alt: `Object ${object.number}`, loading: "lazy"}) : "";
    const events = make("ul", {className: "events"});
    for (const [time, , words] of object.events) {
      events.append(make("li", {}, jumpTo(time, `Object ${object.number} ${words}`), " ", words));
    }
    const cell = (label, ...content) => {
      const it = make("td", {}, ...content);
      if (label) it.dataset.label = label;
      return it;
    };
    const heading = make("th", {scope: "row"}, pick), wide = ["last", "points"];
    const cells = {
      first: cell("First seen", jumpTo(object.first, `Object ${object.number} first seen`)),
      last: cell("Last seen", jumpTo(object.last, `Object ${object.number} last seen`)),
      seen: cell("Seen for", `${object.seen.toFixed(1)} s`),
      points: cell("Points", String(object.points)),
      contact: cell("Time to contact", object.contact === null ? "–" : `${object.contact.toFixed(1)} s`),
    };
    for (const name of wide) cells[name].className = "wide";
    const happened = cell("", object.events.length ? events : "–");
    happened.className = "happened";
    object.row = make("tr", {}, cell("", show), cell("", picture), heading, ...Object.values(cells), happened);
    object.row.dataset.number = object.number;
  }
  let sortKey = "number", ascending = true;
  const refreshTable = () => {
    const words = $("find").value.trim().toLowerCase(), least = Number($("least").value) || 0;
    const fits = object => object.seen >= least && (!$("approaching").checked || object.contact !== null)
      && (!words || String(object.number) === words || object.events.some(event => event[2].toLowerCase().includes(words)));
    const value = object => object[sortKey] === null ? Infinity : object[sortKey];
    const kept = objects.filter(fits).sort((a, b) => {
      // What has no value stays at the end either way.
      const x = value(a), y = value(b);
      if (x === y) return a.number - b.number;
      if (x === Infinity || y === Infinity) return x === Infinity ? 1 : -1;
      return ascending ? x - y : y - x;
    });
    body.replaceChildren(...kept.map(object => object.row));
    $("count").textContent = objects.length ? `${kept.length} of ${objects.length}` : "";
    $("none").hidden = kept.length > 0;
    $("none").textContent = objects.length ? "No object fits the filter." : "Nothing was found that moves by itself.";
  };
  for (const head of document.querySelectorAll("th[data-key]")) {
    head.firstElementChild.addEventListener("click", () => {
      ascending = sortKey === head.dataset.key ? !ascending : true;
      sortKey = head.dataset.key;
      for (const other of document.querySelectorAll("th[data-key]")) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", ascending ? "ascending" : "descending");
      refreshTable();
    });
  }
  for (const id of ["find", "least", "approaching"]) $(id).addEventListener("input", refreshTable);
  const setShown = (object, shown) => {
    object.shown = object.box.checked = shown;
    object.bar.classList.toggle("off", !shown);
  };
  const refreshAll = () => {
    const count = objects.filter(object => object.shown).length;
    $("all").checked = count > 0;
    $("all").indeterminate = count > 0 && count < objects.length;
  };
  $("all").addEventListener("change", () => {
    for (const object of objects) setShown(object, $("all").checked);
    draw(player.currentTime);
  });

  // ---- Plots. ----
  const svg = (name, attributes, parent, text) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    if (text !== undefined) element.textContent = text;
    if (parent) parent.append(element);
    return element;
  };
  const plots = [];
  class Plot {
    constructor(name, title, unit) {
      this.svg = $(`${name}-plot`); this.words = $(`${name}-words`); this.title = title; this.unit = unit;
      this.series = [];
      this.svg.addEventListener("click", event => {
        const box = this.svg.getBoundingClientRect();
        if (this.range) seek(outputTime(this.range[0] + (event.clientX - box.left - 44) / (box.width - 54) * (this.range[1] - this.range[0])));
      });
      plots.push(this);
    }
    // Rows of [input time, value or null, whether it follows the row before], and the range of time.
    set(series, range, missing) {
      this.series = series; this.range = range;
      const known = series.filter(row => row[1] !== null);
      this.words.textContent = known.length ? this.inWords(known) : missing;
      this.svg.setAttribute("aria-label", `${this.title}. ${this.words.textContent}`);
      this.draw();
    }
    inWords(known) {
      let low = known[0], high = known[0];
      for (const row of known) { if (row[1] < low[1]) low = row; if (row[1] > high[1]) high = row; }
      const told = row => `${row[1].toFixed(2)} ${this.unit} at ${clockText(row[0])}`;
      return `Lowest ${told(low)}, highest ${told(high)}.`;
    }
    draw() {
      const width = this.svg.clientWidth || 400, height = this.svg.clientHeight || 190;
      this.svg.replaceChildren();
      this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      this.cursor = null;
      const values = this.series.filter(row => row[1] !== null).map(row => row[1]);
      if (!values.length) { svg("text", {x: width / 2, y: height / 2, "text-anchor": "middle"}, this.svg, "nothing to show"); return; }
      let low = Math.min(0, ...values), high = Math.max(0, ...values);
      if (high - low < 1e-6) high = low + 1;
      const tick = niceStep(high - low, 4);
      low = Math.floor(low / tick + 1e-9) * tick; high = Math.ceil(high / tick - 1e-9) * tick;
      const [begin, end] = this.range;
      const x = time => 44 + (time - begin) / Math.max(end - begin, 1e-6) * (width - 54);
      const y = value => height - 22 - (value - low) / (high - low) * (height - 32);
      for (let value = low; value <= high + tick / 2; value += tick) {
        svg("line", {class: "grid", x1: 44, x2: width - 10, y1: y(value), y2: y(value)}, this.svg);
        svg("text", {x: 40, y: y(value) + 4, "text-anchor": "end"}, this.svg, String(Number(value.toPrecision(4))));
      }
      const every = timeStep(end - begin, Math.max(2, width / 90));
      for (let time = Math.ceil(begin / every - 1e-9) * every; time <= end + 1e-9; time += every) {
        svg("text", {x: x(time), y: height - 6, "text-anchor": x(time) > width - 30 ? "end" : "middle"}, this.svg, shortTime(time, every));
      }
      let path = "", open = false;
      for (const [time, value, follows] of this.series) {
        if (value === null) { open = false; continue; }
        path += `${open && follows ? "L" : "M"}${x(time).toFixed(1)} ${y(value).toFixed(1)}`;
        if (!(open && follows)) path += "h0.01";
        open = true;
      }
      svg("path", {class: "curve", d: path, "stroke-linecap": "round"}, this.svg);
      this.cursor = svg("line", {class: "now", y1: 8, y2: height - 22}, this.svg);
      this.x = x;
      this.mark(player.currentTime);
    }
    mark(time) {
      if (!this.cursor) return;
      const at = inputTime(time), inside = at >= this.range[0] && at <= this.range[1] + 1 / data.fps;
      this.cursor.setAttribute("visibility", inside ? "visible" : "hidden");
      for (const end of ["x1", "x2"]) this.cursor.setAttribute(end, this.x(Math.min(Math.max(at, this.range[0]), this.range[1])));
    }
  }
  const growthPlot = new Plot("growth", "Growth per second", "per second");
  const contactPlot = new Plot("contact", "Time to contact", "s");
  const shearPlot = new Plot("shear", "Shear", "degrees per second");
  const stretchPlot = new Plot("stretch", "Stretch", "pixels per second");

  const option = (value, text) => make("option", {value: String(value), textContent: text});
  for (const object of objects) $("chosen").append(option(object.number, `Object ${object.number}`));
  const choose = number => {
    chosen = number;
    for (const object of objects) {
      const it = object.number === number;
      object.row.classList.toggle("chosen", it);
      object.bar.classList.toggle("chosen", it);
      object.pick.setAttribute("aria-pressed", String(it));
    }
    const object = byNumber.get(number);
    $("approach").hidden = !object;
    if (!object) return;
    $("chosen").value = String(number);
    const series = (column, scale, none) => {
      const rows = [];
      for (let row = object.from; row < object.to; row++) {
        const value = columns[column][row], sample = columns.sample[row];
        rows.push([inputTime(sample * data.every / data.fps), value === none ? null : value / scale,
          row > object.from && sample - columns.sample[row - 1] === 1]);
      }
      return rows;
    };
    const range = [object.first, Math.max(object.last, object.first + 0.1)];
    growthPlot.set(series("growth", 1000, nothing.i2), range, "It is not seen for long enough to tell.");
    contactPlot.set(series("contact", 100, nothing.u2), range, "It does not come closer beyond noise.");
    if (partners.has(number)) { $("first").value = String(number); chooseFirst(); }
    draw(player.currentTime);
  };
  $("chosen").addEventListener("change", () => choose(Number($("chosen").value)));

  // ---- Pairs. ----
  const pairColumns = {
    sample: unpack(data.pairColumns.sample, Uint32Array),
    shear: unpack(data.pairColumns.shear, Uint16Array),
    stretch: unpack(data.pairColumns.stretch, Uint16Array),
  };
  const partners = new Map(), pairAt = new Map();
  place = 0;
  for (const [first, second, count] of data.pairs) {
    pairAt.set(`${first} ${second}`, [place, place + count]);
    place += count;
    for (const [one, other] of [[first, second], [second, first]]) {
      if (!partners.has(one)) partners.set(one, []);
      partners.get(one).push(other);
    }
  }
  const nameOf = number => number ? `Object ${number}` : "Background";
  const fillSelect = (select, numbers, wanted) => {
    select.replaceChildren(...numbers.map(number => option(number, nameOf(number))));
    select.value = String(numbers.includes(wanted) ? wanted : numbers[0]);
  };
  const choosePair = () => {
    const first = Number($("first").value), second = Number($("second").value);
    const [from, to] = pairAt.get(`${Math.min(first, second)} ${Math.max(first, second)}`);
    const rows = (column, scale) => {
      const found = [];
      for (let row = from; row < to; row++) {
        const sample = pairColumns.sample[row];
        found.push([inputTime(sample * data.pairsEvery / data.fps), pairColumns[column][row] / scale,
          row > from && sample - pairColumns.sample[row - 1] === 1]);
      }
      return found;
    };
    const shear = rows("shear", 100);
    const range = [shear[0][0], Math.max(shear[shear.length - 1][0], shear[0][0] + 0.1)];
    shearPlot.set(shear, range, "");
    stretchPlot.set(rows("stretch", 20), range, "");
  };
  const chooseFirst = () => {
    const before = Number($("second").value);
    fillSelect($("second"), partners.get(Number($("first").value)).sort((a, b) => a - b), before);
    choosePair();
  };
  $("first").addEventListener("change", chooseFirst);
  $("second").addEventListener("change", choosePair);

  // ---- What changes with time. ----
  const show = (time = player.currentTime) => {
    draw(time);
    $("cursor").style.left = percent(time);
    const frame = Math.min(Math.floor(time * data.fps + 1e-6), data.frames - 1), now = inputTime(frame / data.fps);
    $("clock").textContent = clockText(now);
    timeline.setAttribute("aria-valuenow", time.toFixed(2));
    timeline.setAttribute("aria-valuetext", clockText(now));
    for (const plot of plots) plot.mark(time);
  };
  if (video && video.requestVideoFrameCallback) {
    const each = (now, told) => { if (!player.paused) show(told.mediaTime + 0.5 / data.fps); video.requestVideoFrameCallback(each); };
    video.requestVideoFrameCallback(each);
  }
  for (const name of ["timeupdate", "seeked", "loadeddata"]) player.addEventListener(name, () => show());
  for (const name of ["play", "pause", "ended"]) {
    player.addEventListener(name, () => {
      $("play").textContent = player.paused ? "Play" : "Pause";
      $("play").setAttribute("aria-pressed", String(!player.paused));
    });
  }
  $("play").addEventListener("click", toggle);
  $("back").addEventListener("click", () => step(-1));
  $("forward").addEventListener("click", () => step(1));
  $("speed").addEventListener("change", () => { player.playbackRate = Number($("speed").value); });
  for (const id of ["outlines", "boxes", "paths"]) $(id).addEventListener("change", () => draw(player.currentTime));
  document.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, button")) return;
    const moves = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: 10, PageDown: -10};
    if (event.key === " ") toggle();
    else if (event.key === ",") step(-1);
    else if (event.key === ".") step(1);
    else if (event.target === timeline && event.key in moves) seek(player.currentTime + moves[event.key]);
    else if (event.target === timeline && event.key === "Home") seek(0);
    else if (event.target === timeline && event.key === "End") seek(duration);
    else return;
    event.preventDefault();
  });
  let pending = 0;
  new ResizeObserver(() => {
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(() => { labelTimeline(); for (const plot of plots) plot.draw(); show(); });
  }).observe(document.body);

  $("between").hidden = !data.pairs.length;
  if (data.pairs.length) {
    fillSelect($("first"), [...partners.keys()].sort((a, b) => a - b).filter(number => number > 0), chosen);
    chooseFirst();
  }
  refreshTable();
  labelTimeline();
  choose(chosen);
  show();
  // An address that ends in #t=12.5 shows that moment of the input.
  const jump = () => {
    const wanted = /^#t=(\d+(?:\.\d+)?)$/.exec(location.hash);
    if (wanted) seek(outputTime(Number(wanted[1])));
  };
  if (video && !video.readyState) video.addEventListener("loadedmetadata", jump, {once: true});
  else jump();
  window.addEventListener("hashchange", jump);
})();
