// Motions that the tests look at: a figure that walks, many of them, a long chain, a plain box.
import { about, box, capsule, place, rotated, square, times, waves } from './shapes.js';

const y = [0, 1, 0];
const grey = [0.78, 0.79, 0.8, 1];
const dark = [0.25, 0.27, 0.3, 1];
const warm = [0.86, 0.55, 0.33, 1];

// name, carried by, where [m], size of its capsule: radius, half length, middle
const limbs = [
  ['pelvis', -1, [0, 0, 0.93], [0.1, 0.07, 0]],
  ['torso', 0, [0, 0, 0.12], [0.125, 0.17, 0.2]],
  ['head', 1, [0, 0, 0.56], [0.095, 0.03, 0.05]],
  ['left_thigh', 0, [0, 0.1, -0.05], [0.065, 0.16, -0.2]],
  ['left_shank', 3, [0, 0, -0.42], [0.05, 0.16, -0.2]],
  ['left_foot', 4, [0, 0, -0.4], [0.04, 0.08, -0.02]],
  ['right_thigh', 0, [0, -0.1, -0.05], [0.065, 0.16, -0.2]],
  ['right_shank', 6, [0, 0, -0.42], [0.05, 0.16, -0.2]],
  ['right_foot', 7, [0, 0, -0.4], [0.04, 0.08, -0.02]],
  ['left_upper_arm', 1, [0, 0.19, 0.36], [0.042, 0.1, -0.13]],
  ['left_forearm', 9, [0, 0, -0.28], [0.036, 0.1, -0.12]],
  ['right_upper_arm', 1, [0, -0.19, 0.36], [0.042, 0.1, -0.13]],
  ['right_forearm', 11, [0, 0, -0.28], [0.036, 0.1, -0.12]],
];

/** Angle [rad] of each limb's joint about y; `phase` shifts one figure against another. */
function angleOf(limb, seconds, phase) {
  const s = Math.sin(2 * Math.PI * 0.9 * seconds + phase);
  const c = Math.cos(2 * Math.PI * 0.9 * seconds + phase);
  return [
    0, 0.06 + 0.02 * s, -0.05, -0.5 * s, 0.45 + 0.4 * c, 0.08 * s, 0.5 * s, 0.45 - 0.4 * c, -0.08 * s, 0.55 * s, -0.5, -0.55 * s, -0.5,
  ][limb];
}

function figurePoses(seconds, phase, speed) {
  const poses = [];
  limbs.forEach(([, parent, where], limb) => {
    const turn = about(y, angleOf(limb, seconds, phase));
    if (parent < 0) {
      const bob = 0.02 * Math.cos(4 * Math.PI * 0.9 * seconds + 2 * phase) - 0.02;
      poses.push({ place: [speed * seconds, 0, where[2] + bob], turn });
    } else {
      const carrier = poses[parent];
      const shift = rotated(carrier.turn, where);
      poses.push({ place: carrier.place.map((value, k) => value + shift[k]), turn: times(carrier.turn, turn) });
    }
  });
  return poses;
}

/** `fine`: limbs of 440 triangles, else of 120. */
function figureParts(fine) {
  const meshes = [];
  const parts = [];
  const coarse = 1;  // what touches the ground is drawn with this mesh, scaled
  limbs.forEach(([name, , , [radius, half, middle]], b) => {
    meshes.push(fine ? capsule(radius, half) : capsule(radius, half, 12, 2));
    const isFoot = name.endsWith('foot');
    const turn = isFoot ? about(y, Math.PI / 2) : [0, 0, 0, 1];
    const where = isFoot ? [0.06, 0, middle] : [0, 0, middle];
    const colour = /foot|head|shank|forearm/.test(name) ? dark : name === 'torso' ? warm : grey;
    parts.push({ link: name, slot: b + 1, mesh: b, layer: 0, place: place(where, [1, 1, 1], turn), colour });
  });
  meshes.push(box(1, 1, 1));
  const cube = meshes.length - 1;
  limbs.forEach(([name, , , [radius, half, middle]], b) => {
    const sides = name.endsWith('foot') ? [half + radius, radius, radius] : [radius, radius, half + radius];
    const where = name.endsWith('foot') ? [0.06, 0, middle] : [0, 0, middle];
    parts.push({ link: name, slot: b + 1, mesh: cube, layer: coarse, place: place(where, sides), colour: [0.2, 0.55, 0.8, 1] });
    const inner = place(where, sides.map((side) => 0.7 * side));
    parts.push({ link: name, slot: b + 1, mesh: cube, layer: 2, place: inner, colour: [0.85, 0.35, 0.5, 1] });
  });
  meshes.push(square(50));
  parts.push({ link: 'ground', slot: 0, mesh: meshes.length - 1, layer: 3, place: place([0, 0, 0]), colour: grey });
  return { meshes, parts };
}

/** A figure of 13 bodies that walks, or `instances` of them. */
export function figure({ instances = 1, frames = 181, rate = 60, speed = 0, title = 'A walking figure' } = {}) {
  const time = Array.from({ length: frames }, (_, f) => f / rate);
  const phases = Array.from({ length: instances }, (_, i) => 0.7 * i);
  const poses = time.map((seconds) => phases.map((phase) => figurePoses(seconds, phase, speed)));
  const curves = [];
  const perSecond = 2 * Math.PI * 0.9;
  const energy = (name, value) => phases.forEach((phase, instance) => {
    curves.push({ group: 'energy', name, unit: 'J', instance, values: time.map((seconds) => value(perSecond * seconds + phase)) });
  });
  energy('kinetic', (angle) => 40 + 12 * Math.cos(2 * angle));
  energy('potential', (angle) => 612 - 14 * Math.cos(2 * angle));
  energy('total', (angle) => 652 - 2 * Math.cos(2 * angle));
  for (const [name, sign] of [['left', 1], ['right', -1]]) {
    const values = time.map((seconds) => Math.max(0, 620 * sign * Math.sin(perSecond * seconds)));
    curves.push({ group: 'foot load', name, unit: 'N', values });
  }
  for (let limb = 1; limb < limbs.length; ++limb) {
    const of = (group, unit, values) => curves.push({ group, name: `${limbs[limb][0]} joint`, unit, body: limb, values });
    of('position', 'rad', time.map((seconds) => angleOf(limb, seconds, 0)));
    of('velocity', 'rad/s', time.map((seconds) => (angleOf(limb, seconds + 1e-5, 0) - angleOf(limb, seconds - 1e-5, 0)) / 2e-5));
    of('force', 'N m', time.map((seconds) => 30 * Math.sin(perSecond * seconds + limb)));
  }
  const feet = [[5, 1], [8, -1]];
  const forces = time.map((seconds, f) => phases.flatMap((phase, i) => feet.flatMap(([body, sign]) => {
    const load = sign * 620 * Math.sin(perSecond * seconds + phase);
    const [px, py] = poses[f][i][body].place;
    return load > 0 ? [[i, body, px + 0.05, py, 0, 0.12 * load, 0, load]] : [];
  })));
  return {
    title, instances, times: time, curves, forces,
    bodies: limbs.map(([name]) => name),
    parents: limbs.map(([, parent]) => parent),
    pose: (f, i, b) => poses[f][i][b],
    ...figureParts(instances < 10),
  };
}

/** Links of one length that hang in a wave. */
export function chain({ links = 10000, frames = 31, rate = 30 } = {}) {
  const length = 20 / links;
  const time = Array.from({ length: frames }, (_, f) => f / rate);
  const poses = time.map((seconds) => {
    const ofFrame = [];
    let where = [0, 0, 0];
    for (let b = 0; b < links; ++b) {
      const s = b / links;
      const turn = about(y, 0.25 + 2.2 * Math.sin(3 * seconds - 9 * s) * s);
      ofFrame.push({ place: where, turn });
      const shift = rotated(turn, [0, 0, -length]);
      where = where.map((value, k) => value + shift[k]);
    }
    return ofFrame;
  });
  return {
    title: `A chain of ${links.toLocaleString('en')} links`,
    times: time,
    bodies: Array.from({ length: links }, (_, b) => `link_${b}`),
    parents: Array.from({ length: links }, (_, b) => b - 1),
    pose: (f, i, b) => poses[f][b],
    meshes: [capsule(0.25, 0.25, 12, 2)],
    parts: Array.from({ length: links }, (_, b) => ({
      link: `link_${b}`, slot: b + 1, mesh: 0, place: place([0, 0, -length / 2], [0.6 * length, 0.6 * length, length]),
      colour: [0.3 + 0.5 * b / links, 0.5, 0.75 - 0.4 * b / links, 1],
    })),
    curves: [{ group: 'energy', name: 'total', unit: 'J', values: time.map((seconds) => 100 + 1e-6 * Math.sin(seconds)) }],
  };
}

/** A red box that goes along a line and turns: small enough to be told from the places of its pixels. */
export function lonelyBox({ half = 0.02, colour = [1, 0, 0, 1], names = ['box'], ...rest } = {}) {
  return {
    title: 'A box', bodies: names, parents: names.map(() => -1), times: [0, 0.5, 1],
    meshes: [box(half, half, half)],
    parts: names.map((name, b) => ({ link: name, slot: b + 1, mesh: 0, place: place([0, 0, 0]), colour })),
    pose: (f, i, b) => ({ place: [0.3 * f - 0.3, 0.2 * f + 0.5 * b, 1 + 0.1 * f], turn: about([0, 0, 1], 0.4 * f) }),
    curves: [],
    ...rest,
  };
}

/** The box on terrain. */
export function hills() {
  const motion = lonelyBox({ half: 0.3, colour: [0.9, 0.5, 0.2, 1] });
  motion.meshes.push(waves(6, 60, 0.4));
  motion.parts.push({ link: 'terrain', slot: 0, mesh: 1, layer: 3, place: place([0, 0, 0]), colour: [0.62, 0.66, 0.58, 1] });
  return motion;
}
