// Lines from each body to the one that carries it, as wide as a pixel however far away: all that can be seen of a chain of ten thousand
// links from where it fits the page.
import { Box3, BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, Matrix4, Vector3 } from 'three';

const thin = 1.2;           // pixels of parts, up to which lines are drawn
const numbersOfPlace = 12;  // as bodies.js has places

/** Lesser side of most parts that are seen [m]: the middle one of them all. */
function thicknessOf(recording) {
  const boxes = recording.meshes.map(({ positions }) => new Box3().setFromArray(positions).getSize(new Vector3()));
  const scale = new Vector3();
  const sides = recording.parts.filter(({ layer }) => layer === 0).map(({ mesh, place }) => {
    scale.setFromMatrixScale(new Matrix4().fromArray(place)).multiply(boxes[mesh]);
    return Math.min(Math.abs(scale.x), Math.abs(scale.y), Math.abs(scale.z));
  });
  return sides.sort((a, b) => a - b)[sides.length >> 1] ?? 0;
}

export function makeThreads(recording) {
  const { instances, parents } = recording;
  const carried = [...parents.keys()].filter((body) => parents[body] >= 0);
  const positions = new Float32Array(6 * instances * carried.length);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  const object = new LineSegments(geometry, new LineBasicMaterial());
  object.frustumCulled = false;
  object.raycast = () => {};
  const thickness = thicknessOf(recording);
  return {
    object,
    /** Whether they are seen: `pixels` of a metre where what is looked at is. */
    show(layers, pixels) {
      object.visible = layers.visual && thickness * pixels < thin;
    },
    /** Between the places of bodies, row-major 3 x 4 of all slots. */
    place(places, slots) {
      if (!object.visible) return;
      for (let i = 0, out = 0; i < instances; ++i) {
        for (const body of carried) {
          for (const slot of [parents[body] + 1, body + 1]) {
            const o = (i * slots + slot) * numbersOfPlace;
            positions[out++] = places[o + 3];
            positions[out++] = places[o + 7];
            positions[out++] = places[o + 11];
          }
        }
      }
      geometry.attributes.position.needsUpdate = true;
    },
    colour(theme) {
      object.material.color.set(theme.thread);
    },
  };
}
