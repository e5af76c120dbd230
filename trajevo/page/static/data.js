"use strict";
// Arrays and texts of the page, as trajevo/page/packing.py packs them.

const TYPES = {f8: Float64Array, f4: Float32Array, i2: Int16Array, u4: Uint32Array, u2: Uint16Array, u1: Uint8Array};

/** The bytes of an element's text, which is base64 of a gzip stream. */
async function unpacked(id) {
  const letters = atob(document.getElementById(id).textContent.trim());
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k += 1) bytes[k] = letters.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** An array of a buffer, with its shape. */
function arrayOf(buffer, place) {
  const count = place.shape.reduce((product, size) => product * size, 1);
  const values = new TYPES[place.type](buffer, place.at, count);
  values.shape = place.shape;
  return values;
}

/** Five significant digits, without an exponent where it can be read without one. */
function shown(value, digits = 5) {
  if (!Number.isFinite(value)) return value > 0 ? "∞" : value < 0 ? "-∞" : "-";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e7 || size < 1e-4)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa}e${exponent.replace("+", "")}`;
  }
  const text = value.toPrecision(digits);
  if (text.includes("e")) return String(Math.round(value));
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

/** Round numbers from low to high, about so many. */
function ticks(low, high, count) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const steps = [1, 2, 2.5, 5, 10].map((factor) => factor * power);
  const step = steps.reduce((best, size) => (Math.abs(Math.log(size / rough)) < Math.abs(Math.log(best / rough)) ? size : best));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k += 1) found.push(k * step);
  return found.map((value) => (Math.abs(value) < 1e-9 * span ? 0 : Number(value.toPrecision(12))));
}

/** An element with attributes and children. */
function made(tag, given = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "text") element.textContent = value;
    else if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}
