// What a file of a motion holds: the two data elements of the page, inflated, checked and laid out as typed arrays.
//
// The format is that of engine/view/page.hpp. Poses and curves stay as they are stored, whole numbers; recording.js decodes a moment of
// them. Whatever is wrong is a DataError, whose message is one sentence for people.

export class DataError extends Error {}

const damaged = (what) => new DataError(`The data of this page is damaged: ${what}. Write the file again.`);

/** Header and sections of the document's motion. Throws DataError. */
export async function readData(document) {
  const headerElement = document.getElementById('linden-header');
  if (!headerElement) throw new DataError('This page holds no motion: it is the empty page that linden fills with data.');
  const header = parseHeader(headerElement.textContent);
  const dataElement = document.getElementById('linden-data');
  if (!dataElement) throw damaged('the element with its numbers is missing');
  const layout = layoutOf(header);
  const { buffer, filled } = await inflate(dataElement.textContent, layout.bytes);
  dataElement.remove();  // as text it is as large as all that was read from it
  const sections = {};
  for (const { name, type, at, count } of layout.sections) {
    sections[name] = new type(buffer, at, count ?? Math.floor((filled - at) / type.BYTES_PER_ELEMENT));
  }
  const meshes = header.meshes.map((_, m) => ({
    positions: sections[`positions ${m}`], normals: sections[`normals ${m}`], indices: sections[`indices ${m}`],
  }));
  sections.places = joined(sections.placesLow, sections.placesHigh);
  delete sections.placesLow;
  delete sections.placesHigh;
  sumAlongFrames(sections.places, 3, header.frames);
  sumAlongFrames(sections.rotations, 3, header.frames);
  sumAlongFrames(sections.curves, header.curves.length, header.frames);
  check(header, sections, meshes);
  return { header, sections, meshes };
}

function parseHeader(text) {
  let header;
  try {
    header = JSON.parse(text);
  } catch {
    throw damaged('its header is not JSON');
  }
  if (header === null || typeof header !== 'object') throw damaged('its header is not an object');
  if (header.format !== 1) {
    const format = String(header.format).slice(0, 20);
    throw new DataError(`This page reads format 1, and its data is format ${format}: write the file again with one version of linden.`);
  }
  if (header.live && location.protocol === 'file:') {
    throw new DataError('This page shows a running simulation: open it from the address that linden view --live prints.');
  }
  for (const name of ['instances', 'frames', 'parts']) {
    if (!Number.isSafeInteger(header[name]) || header[name] < 0) throw damaged(`its header says ${name}: ${JSON.stringify(header[name])}`);
  }
  for (const name of ['bodies', 'joints', 'parents', 'meshes', 'links', 'lines', 'curves']) {
    if (!Array.isArray(header[name])) throw damaged(`its header has no list of ${name}`);
  }
  const bodies = header.bodies.length;
  if (header.joints.length !== bodies || header.parents.length !== bodies) throw damaged('bodies, joints and parents differ in number');
  if (header.links.length !== header.parts) throw damaged('parts and links differ in number');
  for (const { points } of header.lines) {
    const isPoint = (point) => Array.isArray(point) && point.length === 4 && point.every(Number.isFinite) && point[0] >= 0 && point[0] <= bodies;
    if (!Array.isArray(points) || points.length < 2 || !points.every(isPoint)) throw damaged('a line goes through a point that is not there');
  }
  for (const { points, triangles } of header.meshes) {
    if (![points, triangles].every((count) => Number.isSafeInteger(count) && count >= 0)) throw damaged('a mesh has no size');
  }
  const { grid } = header;
  if (header.live) checkLive(header.live);
  if (!Array.isArray(grid) || grid.length !== 4 || !grid.every(Number.isFinite)) throw damaged('its header has no grid of places');
  if (header.frames === 0) throw new DataError('This motion has no frames: nothing was recorded, so there is nothing to show.');
  if (header.instances === 0) throw new DataError('This motion has no instances: nothing was recorded, so there is nothing to show.');
  return header;
}

/** What a page of a running simulation has to know. */
function checkLive({ session, step, forces, weight, servos }) {
  const sound = typeof session === 'string' && step > 0 && Number.isSafeInteger(forces) && forces >= 0 && Number.isFinite(weight) && Array.isArray(servos)
    && servos.every(({ name, unit, least, most }) => typeof name === 'string' && typeof unit === 'string' && Number.isFinite(least) && Number.isFinite(most));
  if (!sound) throw damaged('its header does not say what runs');
}

/** Where each section lies. How many forces there are is known from force_counts alone, so that `forces` takes what is left. */
function layoutOf(header) {
  const { frames, instances, parts } = header;
  const poses = frames * instances * header.bodies.length;
  const sections = [];
  let at = 0;
  const add = (name, type, count) => {
    sections.push({ name, type, at, count });
    at += Math.ceil(count * type.BYTES_PER_ELEMENT / 4) * 4;
  };
  add('times', Float32Array, frames);
  add('partSlots', Int32Array, parts);
  add('partMeshes', Uint32Array, parts);
  add('partLayers', Uint32Array, parts);
  add('partPlaces', Float32Array, parts * 16);
  add('partColours', Float32Array, parts * 4);
  header.meshes.forEach(({ points, triangles }, m) => {
    add(`positions ${m}`, Float32Array, points * 3);
    add(`normals ${m}`, Float32Array, points * 3);
    add(`indices ${m}`, Uint32Array, triangles * 3);
  });
  add('bounds', Float32Array, instances * 6);
  add('placesLow', Uint16Array, 3 * poses);
  add('placesHigh', Uint16Array, 3 * poses);
  add('rotations', Uint16Array, 3 * poses);
  add('largest', Uint8Array, poses);
  add('curves', Uint16Array, header.curves.length * frames);
  add('forceCounts', Uint32Array, frames);
  sections.push({ name: 'forces', type: Float32Array, at, count: undefined });
  return { sections, bytes: at };
}

/** What base64 text holds as a zlib stream, `filled` bytes of a buffer: at least as many as all sections but the forces take. */
async function inflate(text, least) {
  let bytes;
  try {
    bytes = new Uint8Array(least);
  } catch {
    throw new DataError(`This motion takes ${(least / 2 ** 30).toFixed(1)} GiB, more than this browser gives a page: record fewer frames.`);
  }
  const stream = new DecompressionStream('deflate');
  const fed = feed(stream.writable.getWriter(), text.trim());
  const reader = stream.readable.getReader();
  let filled = 0;
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      if (filled + value.length > bytes.length) bytes = enlarged(bytes, filled + value.length);
      bytes.set(value, filled);
      filled += value.length;
    }
    await fed;
  } catch (error) {
    await fed.catch(() => {});
    if (error instanceof DataError) throw error;
    throw damaged('its compressed numbers end early or were changed');
  }
  if (filled < least) throw damaged(`it holds ${filled} bytes where its header asks for ${least}`);
  return { buffer: bytes.buffer, filled };
}

function enlarged(bytes, least) {
  const larger = new Uint8Array(Math.max(least, bytes.length + bytes.length / 4));
  larger.set(bytes);
  return larger;
}

async function feed(writer, text) {
  const piece = 1 << 20;  // characters; a multiple of four, so that each piece is base64 of its own
  try {
    for (let at = 0; at < text.length; at += piece) {
      const binary = atob(text.slice(at, at + piece));
      const bytes = new Uint8Array(binary.length);
      for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
      await writer.write(bytes);
    }
    await writer.close();
  } catch (error) {
    await writer.abort(error).catch(() => {});
    throw error;
  }
}

/** Numbers of 32 bits from the low and the high halves of each. */
function joined(low, high) {
  const numbers = new Uint32Array(low.length);
  for (let i = 0; i < low.length; ++i) numbers[i] = low[i] + 65536 * high[i];
  return numbers;
}

/** Numbers from their differences along frames, modulo what they can hold: `rows` tables of [frames][whatever]. */
function sumAlongFrames(numbers, rows, frames) {
  if (rows === 0) return;
  const row = numbers.length / rows;
  const width = row / frames;
  for (let r = 0; r < rows; ++r) {
    for (let i = r * row + width; i < (r + 1) * row; ++i) numbers[i] += numbers[i - width];
  }
}

function check(header, sections, meshes) {
  const { times, partSlots, partMeshes, partLayers, largest, forceCounts, forces } = sections;
  allFinite(times, 'the times of its frames');
  allFinite(sections.bounds, 'its poses', 'the motion may have diverged');
  allFinite(sections.partPlaces, 'the places of its shapes');
  allFinite(sections.partColours, 'its colours');
  allFinite(forces, 'its forces', 'the motion may have diverged');
  for (let f = 1; f < times.length; ++f) if (times[f] < times[f - 1]) throw damaged(`frame ${f} is earlier than the frame before`);
  for (let p = 0; p < header.parts; ++p) {
    if (partSlots[p] < 0 || partSlots[p] > header.bodies.length) throw damaged(`part ${p} belongs to a body that is not there`);
    if (partMeshes[p] >= meshes.length) throw damaged(`part ${p} has a mesh that is not there`);
    if (partLayers[p] > 3) throw damaged(`part ${p} has a layer that is not there`);
  }
  meshes.forEach(({ positions, normals, indices }, m) => {
    allFinite(positions, `mesh ${m}`);
    allFinite(normals, `mesh ${m}`);
    const points = positions.length / 3;
    for (const index of indices) if (index >= points) throw damaged(`mesh ${m} has a triangle with a point that is not there`);
  });
  for (let i = 0; i < largest.length; ++i) if (largest[i] > 3) throw damaged('a rotation has no largest component');
  let sum = 0;
  for (const count of forceCounts) sum += count;
  if (forces.length !== 8 * sum) throw damaged(`it holds ${forces.length / 8} forces where its frames have ${sum}`);
  for (let i = 0; i < forces.length; i += 8) {
    if (!(forces[i] >= 0 && forces[i] < header.instances)) throw damaged('a force belongs to an instance that is not there');
  }
}

function allFinite(numbers, what, why = 'whoever wrote it met a number that is none') {
  for (let i = 0; i < numbers.length; ++i) {
    if (!Number.isFinite(numbers[i])) throw new DataError(`There are numbers in this page that are not finite, in ${what}: ${why}.`);
  }
}
