// Motions as engine/view/page.hpp says that they are written; made from that text and from nothing of the page's own code.
import { deflateSync } from 'node:zlib';

const aligned = (array) => {
  const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
  return Buffer.concat([bytes, Buffer.alloc((4 - bytes.length % 4) % 4)]);
};

/** Differences along frames of one table [frames][width], first frame whole. */
function differences(table, frames) {
  const width = table.length / frames;
  const out = table.slice();
  for (let i = width; i < table.length; ++i) out[i] = table[i] - table[i - width];
  return out;
}

function quantisedPoses({ frames, instances, bodies, pose }) {
  const width = instances * bodies;
  const places = Array.from({ length: 3 }, () => new Float64Array(frames * width));
  const turns = Array.from({ length: 3 }, () => new Uint16Array(frames * width));
  const largest = new Uint8Array(frames * width);
  for (let f = 0; f < frames; ++f) {
    for (let i = 0; i < instances; ++i) {
      for (let b = 0; b < bodies; ++b) {
        const at = f * width + i * bodies + b;
        const { place, turn } = pose(f, i, b);
        place.forEach((value, k) => { places[k][at] = value; });
        let most = 0;
        for (let k = 1; k < 4; ++k) if (Math.abs(turn[k]) > Math.abs(turn[most])) most = k;
        largest[at] = most;
        const sign = turn[most] < 0 ? -1 : 1;
        [0, 1, 2, 3].filter((k) => k !== most).forEach((k, row) => {
          turns[row][at] = Math.round((sign * turn[k] * Math.SQRT2 + 1) / 2 * 65535);
        });
      }
    }
  }
  const bounds = new Float32Array(instances * 6);
  for (let i = 0; i < instances; ++i) {
    places.forEach((values, k) => {
      let [least, most] = [Infinity, -Infinity];
      for (let f = 0; f < frames; ++f) {
        for (let b = 0; b < bodies; ++b) {
          const value = values[f * width + i * bodies + b];
          least = Math.min(least, value);
          most = Math.max(most, value);
        }
      }
      bounds[6 * i + k] = least;
      bounds[6 * i + 3 + k] = most - least;
    });
  }
  const step = 1e-5;
  const least = places.map((values) => values.reduce((a, b) => Math.min(a, b), Infinity));
  const steps = places.map((values, k) => Uint32Array.from(values, (value) => Math.round((value - least[k]) / step)));
  return { bounds, grid: [...least, step], places: steps, turns, largest };
}

function quantisedCurve(values) {
  let [least, most] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  const scale = most > least ? 65534 / (most - least) : 0;
  const row = Uint16Array.from(values, (value) => (Number.isNaN(value) ? 0 : 1 + Math.round((value - least) * scale)));
  return { least, most, row };
}

/** Header and data of a motion; `change(sections)` may spoil what is written. */
export function encode(motion, change = (sections) => sections) {
  const { title = 'a motion', instances = 1, bodies, parents, meshes, parts, times, pose } = motion;
  const { joints = bodies.map((name) => `${name} joint`) } = motion;
  const { curves = [], forces = times.map(() => []), error = { place: 1e-5, angle: 7.5e-5 }, notes = [] } = motion;
  const frames = times.length;
  const { bounds, grid, places, turns, largest } = quantisedPoses({ frames, instances, bodies: bodies.length, pose });
  const drawn = curves.map((curve) => quantisedCurve(curve.values));
  const header = {
    format: 1, title, instances, frames, bodies, joints, parents,
    parts: parts.length,
    meshes: meshes.map(({ positions, indices }) => ({ points: positions.length / 3, triangles: indices.length / 3 })),
    links: parts.map(({ link }) => link),
    lines: motion.lines ?? [],
    curves: curves.map(({ group, name, unit = '', body = -1, instance = 0 }, c) => {
      const { least, most } = drawn[c];
      return { group, name, unit, body, instance, least, most };
    }),
    grid, error, notes,
  };
  const sections = change([
    Float32Array.from(times),
    Int32Array.from(parts, ({ slot }) => slot),
    Uint32Array.from(parts, ({ mesh }) => mesh),
    Uint32Array.from(parts, ({ layer = 0 }) => layer),
    Float32Array.from(parts.flatMap(({ place }) => place)),
    Float32Array.from(parts.flatMap(({ colour }) => colour)),
    ...meshes.flatMap(({ positions, normals, indices }) => [
      Float32Array.from(positions), Float32Array.from(normals), Uint32Array.from(indices),
    ]),
    bounds,
    ...halves(concatenated(places.map((row) => differences(row, frames)), Uint32Array)),
    concatenated(turns.map((row) => differences(row, frames))),
    largest,
    concatenated(drawn.map(({ row }) => differences(row, frames))),
    Uint32Array.from(forces, (ofFrame) => ofFrame.length),
    Float32Array.from(forces.flat(2)),
  ]);
  return { header, data: deflateSync(Buffer.concat(sections.map(aligned)), { level: 6 }).toString('base64') };
}

/** The low sixteen bits of each number, and the high ones. */
const halves = (numbers) => [Uint16Array.from(numbers, (n) => n & 0xffff), Uint16Array.from(numbers, (n) => n >>> 16)];

function concatenated(rows, type = Uint16Array) {
  const out = new type(rows.reduce((sum, row) => sum + row.length, 0));
  let at = 0;
  for (const row of rows) {
    out.set(row, at);
    at += row.length;
  }
  return out;
}

/** The whole page of a motion. */
export function pageOf(template, { header, data }) {
  const text = JSON.stringify(header).replaceAll('<', '\\u003c');
  return template.replace('<!-- linden data -->', () => `<script type="application/json" id="linden-header">${text}</script>\n`
    + `<script type="application/octet-stream;base64" id="linden-data">${data}</script>`);
}
