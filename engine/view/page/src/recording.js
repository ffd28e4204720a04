// A motion as the page plays it. A source of motion offers
//
//   names         title, bodies, joints, parents, links, instances, ...
//   times         [s] of its frames, rising
//   span          {begin, duration} that curves are drawn over [s]
//   poseInto(moment, out)   poses of all instances and bodies at a moment {frame, fraction}: x y z and quaternion x y z w of each
//   curves        numbers over time
//   forcesOf(frame)
//
// and a recording offers it from what data.js read, its first time 0; a running simulation (live.js) from what it was sent. Nothing of a
// recording is kept decoded.

export const poseSize = 7;  // numbers: place x y z [m], quaternion x y z w

export function makeRecording({ header, sections, meshes }) {
  const { times } = sections;
  return {
    title: String(header.title ?? ''),
    notes: (header.notes ?? []).map(String),
    error: header.error ?? null,
    instances: header.instances,
    bodies: header.bodies.map(String),
    joints: header.joints.map(String),
    parents: header.parents,
    lines: header.lines,
    frames: header.frames,
    times,
    duration: times[times.length - 1],
    span: { begin: 0, duration: times[times.length - 1] },
    bounds: sections.bounds,
    meshes,
    parts: partsOf(header, sections),
    curves: curvesOf(header, sections),
    poseInto: poseReader(header, sections),
    ...forceReader(sections),
  };
}

function partsOf(header, { partSlots, partMeshes, partLayers, partPlaces, partColours }) {
  return header.links.map((link, p) => ({
    link: String(link),
    slot: partSlots[p],
    mesh: partMeshes[p],
    layer: partLayers[p],
    place: partPlaces.subarray(16 * p, 16 * p + 16),
    colour: partColours.subarray(4 * p, 4 * p + 4),
  }));
}

function curvesOf(header, { curves }) {
  const frames = header.frames;
  return header.curves.map(({ group, name, unit, body, instance, least, most }, c) => {
    const numbers = curves.subarray(c * frames, (c + 1) * frames);
    const step = (most - least) / 65534;
    return {
      group: String(group), name: String(name), unit: String(unit ?? ''), body, instance, least, most, frames,
      /** NaN where there is no number. */
      value: (frame) => (numbers[frame] === 0 ? NaN : least + (numbers[frame] - 1) * step),
    };
  });
}

function poseReader(header, { places, rotations, largest }) {
  const { frames, instances } = header;
  const bodies = header.bodies.length;
  const width = instances * bodies;
  const plane = frames * width;
  const [x, y, z, step] = header.grid;
  const half = Math.SQRT1_2;
  const unit = 2 * half / 65535;

  const quaternions = new Float64Array(8);  // of two frames
  const quaternionInto = (at, place) => {
    const a = rotations[at] * unit - half;
    const b = rotations[plane + at] * unit - half;
    const c = rotations[2 * plane + at] * unit - half;
    const rest = Math.sqrt(Math.max(0, 1 - a * a - b * b - c * c));
    const left = largest[at];
    quaternions[place] = left === 0 ? rest : a;
    quaternions[place + 1] = left === 0 ? a : left === 1 ? rest : b;
    quaternions[place + 2] = left < 2 ? b : left === 2 ? rest : c;
    quaternions[place + 3] = left === 3 ? rest : c;
  };

  return ({ frame, fraction }, out) => {
    const rest = 1 - fraction;
    for (let b = 0; b < width; ++b) {
      const here = frame * width + b;
      const next = fraction > 0 ? here + width : here;
      const o = b * poseSize;
      out[o] = x + step * (rest * places[here] + fraction * places[next]);
      out[o + 1] = y + step * (rest * places[plane + here] + fraction * places[plane + next]);
      out[o + 2] = z + step * (rest * places[2 * plane + here] + fraction * places[2 * plane + next]);
      quaternionInto(here, 0);
      if (fraction > 0) {
        quaternionInto(next, 4);
        blend(quaternions, fraction);
      }
      out[o + 3] = quaternions[0];
      out[o + 4] = quaternions[1];
      out[o + 5] = quaternions[2];
      out[o + 6] = quaternions[3];
    }
  };
}

/** Turns q[0..3] towards q[4..7] by `fraction` of the shorter arc (Shoemake's slerp). */
function blend(q, fraction) {
  let cosine = q[0] * q[4] + q[1] * q[5] + q[2] * q[6] + q[3] * q[7];
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(1, cosine * sign);
  let [here, there] = [1 - fraction, fraction];
  if (cosine < 0.9999) {
    const angle = Math.acos(cosine);
    const sine = Math.sin(angle);
    here = Math.sin(here * angle) / sine;
    there = Math.sin(there * angle) / sine;
  }
  there *= sign;
  let square = 0;
  for (let k = 0; k < 4; ++k) {
    q[k] = here * q[k] + there * q[k + 4];
    square += q[k] * q[k];
  }
  const scale = 1 / Math.sqrt(square);
  for (let k = 0; k < 4; ++k) q[k] *= scale;
}

function forceReader({ forceCounts, forces }) {
  const begins = new Uint32Array(forceCounts.length + 1);
  let mostForces = 0;
  for (let f = 0; f < forceCounts.length; ++f) {
    begins[f + 1] = begins[f] + forceCounts[f];
    mostForces = Math.max(mostForces, forceCounts[f]);
  }
  return {
    forces,
    mostForces,
    /** Forces of a frame, eight numbers each: instance, body, place, force. */
    forcesOf: (frame) => forces.subarray(8 * begins[frame], 8 * begins[frame + 1]),
  };
}

/** The moment {frame, fraction} of a time [s]: fraction 0 at a frame itself. */
export function momentOf(times, seconds) {
  const last = times.length - 1;
  if (!(seconds > 0)) return { frame: 0, fraction: 0 };
  if (seconds >= times[last]) return { frame: last, fraction: 0 };
  let [low, high] = [0, last];  // times[low] <= seconds < times[high]
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= seconds) low = middle;
    else high = middle;
  }
  return { frame: low, fraction: (seconds - times[low]) / (times[high] - times[low]) };
}
