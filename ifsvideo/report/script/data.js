// What the page is given, and small helpers.

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
