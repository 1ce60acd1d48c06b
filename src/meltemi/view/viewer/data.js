"use strict";
// Scenes: constants and arrays out of bytes, and tracks, whose values in time are few amplitudes of 16 bits.

const TYPES = { int8: Int8Array, int16: Int16Array, float32: Float32Array };

/** Bytes of base64. A loop, because a function per byte takes half a second for ten minutes of motion. */
function decoded(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

/** The scene {about, arrays} in bytes; the format is that of scene/record.py. */
function readScene(bytes) {
  let at = bytes.indexOf(10) + 1; // the first line names the format
  const size = new DataView(bytes.buffer, bytes.byteOffset).getUint32(at, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(at + 4, at + 4 + size)));
  at += 4 + size;
  const arrays = {};
  for (const [name, [type, shape]] of Object.entries(head.arrays)) {
    const count = shape.reduce((a, b) => a * b, 1), length = count * TYPES[type].BYTES_PER_ELEMENT;
    arrays[name] = new TYPES[type](bytes.slice(at, at + length).buffer);
    arrays[name].shape = shape;
    at += Math.ceil(length / 4) * 4;
  }
  return { about: head.about, arrays };
}

/** Place of a time in a series of equal steps: [row, next row, weight of the next]. */
function place(t, step, rows) {
  const x = Math.min(Math.max(t / step, 0), rows - 1), i = Math.min(Math.floor(x), Math.max(rows - 2, 0));
  return [i, Math.min(i + 1, rows - 1), x - i];
}

/** A series of arrays in time: value = mean + sum of amplitude times scale times basis. */
class Track {
  constructor(scene, name, step) {
    const array = (part) => scene.arrays[`${name}.${part}`];
    this.amplitude = array("amplitude");
    this.scale = array("scale");
    this.mean = array("mean");
    this.basis = array("basis");
    this.step = step;
    this.count = this.scale.length;
    this.rows = this.amplitude.shape[0];
    this.series = this.amplitude.length / (this.rows * this.count);
    this.size = this.mean.length;
  }

  /** Values of one of the series at a time [s], into ``out``. */
  at(t, out, series = 0) {
    const [i, j, w] = place(t, this.step, this.rows), K = this.count, width = this.series * K;
    const a = i * width + series * K, b = j * width + series * K;
    out.set(this.mean);
    for (let k = 0; k < K; k++) {
      const x = this.scale[k] * ((1 - w) * this.amplitude[a + k] + w * this.amplitude[b + k]);
      if (!this.basis) out[k] += x;
      else for (let n = 0, at = k * this.size; n < this.size; n++, at++) out[n] += x * this.basis[at];
    }
    return out;
  }
}

/** Linear interpolation of a table of (x, y) at a place. */
function interpolate(x, y, at, every = 1, offset = 0) {
  let i = 1;
  while (i < x.length - 1 && x[i] < at) i++;
  const w = Math.min(Math.max((at - x[i - 1]) / (x[i] - x[i - 1]), 0), 1);
  return (1 - w) * y[(i - 1) * every + offset] + w * y[i * every + offset];
}

/** A number with three or four digits, and thin spaces between thousands. */
function short(x) {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x), digits = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  return grouped(x.toFixed(digits));
}
function grouped(text) {
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−").replace(/\B(?=(\d{3})+(?!\d))(?<!\.\d*)/g, "\u2009");
}
