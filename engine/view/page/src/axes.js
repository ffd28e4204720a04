// Frames of bodies: x red, y green, z blue, seen through whatever is before them.
import { BoxGeometry, BufferAttribute, Color, DynamicDrawUsage, InstancedMesh, MeshBasicMaterial } from 'three';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';

const colours = ['#d84b3f', '#4f9e3a', '#3b78d8'];

/** Three thin bars of length 1. */
function triad() {
  const bars = colours.map((colour, axis) => {
    const sides = [0.07, 0.07, 0.07];
    sides[axis] = 1;
    const bar = new BoxGeometry(...sides);
    bar.translate(...[0, 1, 2].map((other) => (other === axis ? 0.5 : 0)));
    const { r, g, b } = new Color(colour);
    const points = bar.attributes.position.count;
    bar.setAttribute('color', new BufferAttribute(new Float32Array(3 * points).map((_, k) => [r, g, b][k % 3]), 3));
    return bar;
  });
  return mergeGeometries(bars);
}

/** How long axes are drawn: a third of what usually lies between a body and the next. */
function lengthOf(recording, size, poses) {
  const gaps = [];
  const bodies = recording.bodies.length;
  for (let b = 0; b < bodies; ++b) {
    const parent = recording.parents[b];
    if (parent >= 0) gaps.push(Math.hypot(...[0, 1, 2].map((k) => poses[7 * b + k] - poses[7 * parent + k])));
  }
  gaps.sort((a, b) => a - b);
  const usual = gaps.length ? gaps[Math.floor(gaps.length / 2)] : size;
  return Math.min(0.12 * size, Math.max(0.5 * usual, 0.004 * size));
}

export function makeAxes(recording, size, firstPoses) {
  const count = recording.instances * recording.bodies.length;
  const material = new MeshBasicMaterial({ vertexColors: true, depthTest: false, depthWrite: false, transparent: true, toneMapped: false });
  const length = lengthOf(recording, size, firstPoses);
  let object = null;

  return {
    /** Made when first shown: few ever look at them. */
    object() {
      if (!object) {
        object = new InstancedMesh(triad(), material, count);
        object.instanceMatrix.setUsage(DynamicDrawUsage);
        object.frustumCulled = false;
        object.renderOrder = 5;
        object.visible = false;
      }
      return object;
    },
    show(shown) {
      if (object || shown) this.object().visible = shown;
    },
    /** Rows of places as bodies.js has them. */
    place(places, slots) {
      if (!object?.visible) return;
      const matrices = object.instanceMatrix.array;
      let out = 0;
      for (let i = 0; i < recording.instances; ++i) {
        for (let s = 1; s < slots; ++s, out += 16) {
          const at = (i * slots + s) * 12;
          for (let row = 0; row < 3; ++row) {
            matrices[out + row] = length * places[at + 4 * row];
            matrices[out + 4 + row] = length * places[at + 4 * row + 1];
            matrices[out + 8 + row] = length * places[at + 4 * row + 2];
            matrices[out + 12 + row] = places[at + 4 * row + 3];
          }
          matrices[out + 15] = 1;
        }
      }
      object.instanceMatrix.needsUpdate = true;
    },
  };
}
