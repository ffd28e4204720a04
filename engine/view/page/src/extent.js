// How large what is shown is: what the camera, the grid, shadows, arrows and the places of instances are measured by.
import { Box3, Matrix4, Quaternion, Vector3 } from 'three';
import { poseSize } from './recording.js';

const [visual, collision, inertia] = [0, 1, 2];  // layers

/**
 * first   [instances] boxes of all parts at the first frame, without offsets between instances [m]
 * origins [instances] boxes of the places of bodies during the motion
 * whole   [instances] boxes that no part leaves during the motion
 * size    longest side of the first instance's box at the first frame
 */
export function extentOf(recording) {
  const boxes = recording.meshes.map(({ positions }) => new Box3().setFromArray(positions));
  const seen = recording.parts.some(({ layer }) => layer === visual) ? [visual] : [collision, inertia];
  const parts = recording.parts.filter(({ layer }) => seen.includes(layer)).map((part) => placedCorners(part, boxes[part.mesh]));
  let reach = 0;  // of a part from the origin of the body that carries it
  for (const { slot, corners } of parts) if (slot > 0) for (const corner of corners) reach = Math.max(reach, corner.length());
  const poses = new Float32Array(recording.instances * recording.bodies.length * poseSize);
  recording.poseInto({ frame: 0, fraction: 0 }, poses);
  const first = [];
  const origins = [];
  const whole = [];
  for (let i = 0; i < recording.instances; ++i) {
    first.push(firstBox(recording, parts, poses, i));
    const least = new Vector3().fromArray(recording.bounds, 6 * i);
    const most = new Vector3().fromArray(recording.bounds, 6 * i + 3).add(least);
    origins.push(recording.bodies.length ? new Box3(least, most) : first[i].clone());
    whole.push(origins[i].clone().expandByScalar(reach).union(first[i]));
  }
  const side = first[0].getSize(new Vector3());
  const size = Math.max(side.x, side.y, side.z) || 1;
  return { first, origins, whole, size };
}

/** Corners of the box around a part, in its body's frame. */
function placedCorners({ slot, place }, box) {
  if (box.isEmpty()) return { slot, corners: [] };
  const matrix = new Matrix4().fromArray(place);
  const sides = [box.min, box.max];
  const corners = Array.from({ length: 8 }, (_, k) => new Vector3(sides[k & 1].x, sides[k >> 1 & 1].y, sides[k >> 2].z).applyMatrix4(matrix));
  return { slot, corners };
}

function firstBox(recording, parts, poses, instance) {
  const box = new Box3();
  const place = new Vector3();
  const shift = new Vector3();
  const turn = new Quaternion();
  for (const { slot, corners } of parts) {
    const o = (instance * recording.bodies.length + slot - 1) * poseSize;
    if (slot > 0) {
      turn.fromArray(poses, o + 3);
      shift.fromArray(poses, o);
    } else {
      turn.identity();
      shift.set(0, 0, 0);
    }
    for (const corner of corners) box.expandByPoint(place.copy(corner).applyQuaternion(turn).add(shift));
  }
  for (let b = 0; b < recording.bodies.length; ++b) {
    box.expandByPoint(place.fromArray(poses, (instance * recording.bodies.length + b) * poseSize));
  }
  return box.isEmpty() ? box.set(new Vector3(-0.5, -0.5, 0), new Vector3(0.5, 0.5, 1)) : box;
}

/** Places of instances [2 x instances, m]: all where they are, or in rows beside one another. */
export function offsetsOf({ first, whole, size }, sideBySide) {
  const instances = first.length;
  const offsets = new Float32Array(2 * instances);
  if (!sideBySide) return offsets;
  const pitch = [0, 1].map((axis) => {
    const side = (box) => box.max.getComponent(axis) - box.min.getComponent(axis);
    return Math.min(1.25 * side(whole[0]), 2 * size) || size;
  });
  // about as wide as deep
  const columns = Math.max(1, Math.min(instances, Math.round(Math.sqrt(instances * pitch[1] / pitch[0]))));
  const rows = Math.ceil(instances / columns);
  for (let i = 0; i < instances; ++i) {
    offsets[2 * i] = (i % columns - (columns - 1) / 2) * pitch[0];
    offsets[2 * i + 1] = ((rows - 1) / 2 - Math.floor(i / columns)) * pitch[1];
  }
  return offsets;
}

/** Box around all instances where they stand, of boxes without offsets. */
export function boxOfAll(boxes, offsets) {
  const all = new Box3();
  const shifted = new Box3();
  boxes.forEach((box, i) => all.union(shifted.copy(box).translate(new Vector3(offsets[2 * i], offsets[2 * i + 1], 0))));
  return all;
}
