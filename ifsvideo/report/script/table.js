// The table of objects: sorts, filters, and switches them on and off in the picture.

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
