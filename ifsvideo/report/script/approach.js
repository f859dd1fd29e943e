// How the chosen object comes closer.

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
  contactPlot.set(series("contact", 100, nothing.u2), range, object.contact === null
    ? "It does not come closer beyond noise." : `${object.contact.toFixed(1)} s, but for a moment only.`);
  if (partners.has(number)) { $("first").value = String(number); chooseFirst(); }
  draw(player.currentTime);
};
$("chosen").addEventListener("change", () => choose(Number($("chosen").value)));
