// Forces of contacts as arrows from where they push, as long as they are strong.
import { ConeGeometry, CylinderGeometry, Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';

/** How strong the strong pushes are, but for the few strongest [N]. */
function strongOf(forces) {
  const strengths = [];
  const every = Math.max(1, Math.floor(forces.length / 8 / 20000));
  for (let i = 0; i < forces.length; i += 8 * every) strengths.push(Math.hypot(forces[i + 5], forces[i + 6], forces[i + 7]));
  strengths.sort((a, b) => a - b);
  return strengths[Math.floor(0.95 * (strengths.length - 1))] || 1;
}

/** Newton that a metre of arrow stands for: strong pushes are as long as a third of what is shown. */
function scaleOf(strong, size) {
  const power = 10 ** Math.floor(Math.log10(strong / (0.35 * size)));
  return [1, 2, 5, 10].find((step) => step * power >= strong / (0.35 * size)) * power;
}

export function makeArrows(recording, size) {
  const object = new Group();
  object.visible = false;
  if (recording.mostForces === 0) return { object, newtonPerMetre: 0, place() {}, colour() {} };

  const newtonPerMetre = scaleOf(recording.strongForce || strongOf(recording.forces), size);
  const material = new MeshBasicMaterial({ toneMapped: false, depthTest: false, transparent: true })  // seen through feet;
  const thickness = 0.008 * size;
  const upright = (geometry) => geometry.translate(0, 0.5, 0).rotateX(Math.PI / 2);  // along z, from 0 to 1
  const shafts = new InstancedMesh(upright(new CylinderGeometry(1, 1, 1, 12)), material, recording.mostForces);
  const heads = new InstancedMesh(upright(new ConeGeometry(1, 1, 16)), material, recording.mostForces);
  for (const mesh of [shafts, heads]) {
    mesh.frustumCulled = false;
    mesh.renderOrder = 4;
    object.add(mesh);
  }
  const [place, along, up] = [new Vector3(), new Vector3(), new Vector3(0, 0, 1)];
  const [turn, matrix, side] = [new Quaternion(), new Matrix4(), new Vector3()];

  return {
    object,
    newtonPerMetre,
    place(frame, offsets) {
      if (!object.visible) return;
      const forces = recording.forcesOf(frame);
      let count = 0;
      for (let i = 0; i < forces.length; i += 8) {
        along.fromArray(forces, i + 5);
        const length = along.length() / newtonPerMetre;
        if (length < 0.5 * thickness) continue;
        turn.setFromUnitVectors(up, along.normalize());
        place.fromArray(forces, i + 2);
        place.x += offsets[2 * forces[i]];
        place.y += offsets[2 * forces[i] + 1];
        const head = Math.min(5 * thickness, 0.5 * length);
        shafts.setMatrixAt(count, matrix.compose(place, turn, side.set(thickness, thickness, length - head)));
        place.addScaledVector(along, length - head);
        heads.setMatrixAt(count, matrix.compose(place, turn, side.set(2.4 * thickness, 2.4 * thickness, head)));
        ++count;
      }
      for (const mesh of [shafts, heads]) {
        mesh.count = count;
        mesh.instanceMatrix.needsUpdate = true;
      }
    },
    colour({ force }) {
      material.color.set(force);
    },
  };
}
