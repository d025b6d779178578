// What Python has written: facts as JSON, and numbers, most of them rounded to sixteen bits.

const THREE = MeshCat.THREE;
const facts = JSON.parse(document.getElementById("facts").textContent);
const MISSING = 65535;

// The bytes of a base64 text.
function bytesOf(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Columns of numbers: a code c of column j stands for low[j] + step[j] c, or for the exponential of that.
class Rounded {
  constructor(codes, entry) {
    this.codes = codes;
    [this.rows, this.columns] = entry.shape;
    Object.assign(this, { low: entry.low, step: entry.step, log: entry.log });
    let kept = 0; // columns that do not change are not stored
    this.start = this.step.map((step) => (step > 0 ? this.rows * kept++ : -1));
  }

  get(row, column) {
    const start = this.start[column];
    const code = start < 0 ? Number(this.log) : this.codes[start + row];
    if (code === MISSING) return NaN;
    if (!this.log) return this.low[column] + this.step[column] * code;
    return code === 0 ? 0 : Math.exp(this.low[column] + this.step[column] * (code - 1));
  }

  row(row) {
    return this.low.map((_, column) => this.get(row, column));
  }

  column(column) {
    return Float64Array.from({ length: this.rows }, (_, row) => this.get(row, column));
  }

  // All numbers row by row.
  flat() {
    const out = new Float32Array(this.rows * this.columns);
    for (let column = 0; column < this.columns; column++)
      for (let row = 0; row < this.rows; row++) out[row * this.columns + column] = this.get(row, column);
    return out;
  }
}

// Two typed arrays one after the other, in the type of the first; they may be too long to be spread.
function chained(first, second) {
  const out = new first.constructor(first.length + second.length);
  out.set(first);
  out.set(second, first.length);
  return out;
}

// Rows of columns, and after them further rows.
class Stacked {
  constructor(first, second) {
    Object.assign(this, { first, second, rows: first.rows + second.rows, columns: first.columns });
  }

  get(row, column) {
    return row < this.first.rows ? this.first.get(row, column) : this.second.get(row - this.first.rows, column);
  }

  row(row) {
    return row < this.first.rows ? this.first.row(row) : this.second.row(row - this.first.rows);
  }

  column(column) {
    return chained(this.first.column(column), this.second.column(column));
  }
}

class Numbers {
  constructor(bytes, entries = facts.numbers) {
    Object.assign(this, { bytes, entries });
    this.read = new Map();
  }

  static async load() {
    const element = document.getElementById("numbers");
    const numbers = new Numbers(await inflated(bytesOf(element.textContent)));
    element.remove();
    return numbers;
  }

  has(name) {
    return name in this.entries;
  }

  // An array as it was written, or a Rounded.
  get(name) {
    if (!this.read.has(name)) this.read.set(name, this.decoded(this.entries[name]));
    return this.read.get(name);
  }

  // More grasps: further rows of the columns, in numbers that have been sent later.
  append(more) {
    for (const name of Object.keys(more.entries)) {
      const rows = more.get(name);
      if (rows instanceof Rounded) this.read.set(name, new Stacked(this.get(name), rows));
    }
  }

  decoded(entry) {
    const types = { Uint8Array, Uint16Array, Uint32Array, Int8Array, Float32Array, Float64Array };
    const Type = types[entry.type];
    const columns = entry.step ? entry.step.filter((step) => step > 0).length : entry.shape[1];
    const count = entry.shape[0] * columns, size = Type.BYTES_PER_ELEMENT;
    const out = new Uint8Array(count * size); // from planes of bytes, the first ones first
    for (let plane = 0, at = entry.at; plane < size; plane++)
      for (let i = 0; i < count; i++) out[i * size + plane] = this.bytes[at++];
    const values = new Type(out.buffer);
    return entry.step ? new Rounded(values, entry) : values;
  }
}

// A number as it is read: four digits that count.
function short(value, digits = 4) {
  if (value === null || Number.isNaN(value)) return "\u2013";
  if (!Number.isFinite(value)) return value > 0 ? "\u221e" : "-\u221e";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 2).replace("e+", "e");
  const text = value.toPrecision(digits);
  return text.includes("e") ? String(Number(text)) : text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

// An element with a class and text; text never becomes markup.
function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

const byId = (id) => document.getElementById(id);
