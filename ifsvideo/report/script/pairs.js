// Shear and stretch between two objects.

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
