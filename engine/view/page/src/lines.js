// Cables, springs and rods between bodies: straight from point to point, a few pixels wide however far away.
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

const width = 2.5;          // [pixels]
const numbersOfPlace = 12;  // as bodies.js has places

export function makeLines(recording) {
  const { instances, lines } = recording;
  const pieces = lines.flatMap(({ points }) => points.slice(1).map((point, k) => [points[k], point]));
  const positions = new Float32Array(6 * instances * pieces.length);
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(positions);
  const object = new LineSegments2(geometry, new LineMaterial({ linewidth: width }));
  object.frustumCulled = false;
  object.raycast = () => {};
  object.visible = false;
  const ends = geometry.attributes.instanceStart.data;
  return {
    object,
    show(layers) {
      object.visible = layers.visual && pieces.length > 0;
    },
    /** Between places on bodies, whose own are row-major 3 x 4 of all slots. */
    place(places, slots) {
      if (!object.visible) return;
      let out = 0;
      for (let i = 0; i < instances; ++i) {
        for (const piece of pieces) {
          for (const [slot, x, y, z] of piece) {
            const o = (i * slots + slot) * numbersOfPlace;
            for (let row = o; row < o + numbersOfPlace; row += 4) {
              ends.array[out++] = places[row] * x + places[row + 1] * y + places[row + 2] * z + places[row + 3];
            }
          }
        }
      }
      ends.needsUpdate = true;
    },
    colour(theme) {
      object.material.color.set(theme.cable);
    },
  };
}
