// Bodies, drawn by instances: all parts that share a mesh, a layer, an opacity and a handedness are one draw call, over all instances.
import {
  Box3, BoxGeometry, BufferAttribute, BufferGeometry, Color, DoubleSide, InstancedMesh, Matrix4, MeshStandardMaterial, Sphere,
  SRGBColorSpace, Vector3,
} from 'three';
import { poseSize } from './recording.js';

export const layerNames = ['visual', 'collision', 'inertia', 'ground'];
const numbersOfPlace = 12;  // three rows of a rigid motion
const manyTriangles = 100000;  // in a draw call, from which on it pays to look whether they can be seen
const fewPixels = 3.5;         // radius up to which a box does for a mesh
const noPixels = 0.5;          // and up to which nothing is seen

export function makeBodies(recording) {
  const { instances } = recording;
  const slots = recording.bodies.length + 1;  // 0: the world
  const places = new Float32Array(instances * slots * numbersOfPlace);
  const groups = groupsOf(recording).map((group) => drawnGroup(group, recording));
  let selected = null;

  return {
    groups,
    /** Puts all parts where poses are, each instance shifted by its offset [x, y]. */
    place(poses, offsets) {
      placesInto(poses, offsets, instances, slots, places);
      for (const group of groups) if (group.shown) matricesInto(group, places, instances, slots);
    },
    /** Origin of a body on screen or elsewhere, after place(); body -1 is the world. */
    originInto(body, instance, out) {
      const o = (instance * slots + body + 1) * numbersOfPlace;
      return out.set(places[o + 3], places[o + 7], places[o + 11]);
    },
    /** Row-major 3 x 4 places of all slots, after place(). */
    places,
    slots,
    show(layers) {
      // through what is outside one sees what is inside: inertia in visual shapes in collision shapes
      const seeThrough = [layers.inertia, layers.visual || layers.inertia, false];
      for (const group of groups) {
        const { object, layer, opacity } = group;
        group.shown = layers[layerNames[layer]];  // whether or not so near that it is drawn
        const shown = seeThrough[layer] ? 0.35 * opacity : opacity;
        const { material } = object;
        if (material.transparent !== shown < 1) material.needsUpdate = true;
        material.transparent = shown < 1;
        material.opacity = shown;
        object.renderOrder = [2, 3, 1][layer];
        object.castShadow = shown >= 0.3;
      }
    },
    /** Colours a body of an instance, and gives the one before its own colours back; null: none. */
    mark(selection, colour) {
      if (selected) paint(groups, selected, null);
      selected = selection;
      if (selected) paint(groups, selected, colour);
    },
    /** Of many small meshes draws boxes where none is larger than some pixels, and nothing where none can be seen and threads stand in for
        them; `pixels`: of a metre at a distance of a metre. */
    simplify(eye, pixels, threaded) {
      for (const group of groups) {
        const { object, detailed, plain } = group;
        object.visible = group.shown;
        if (plain === detailed || !group.shown) continue;
        const size = group.extent * pixels / nearest(object, eye);
        object.geometry = size < fewPixels ? plain : detailed;
        object.visible = !(threaded && group.layer === 0 && size < noPixels);
      }
    },
    /** Body and instance of a hit: an object of a group and the number of its instance. */
    owner(object, instanceId) {
      const group = groups.find((candidate) => candidate.object === object);
      if (!group) return null;
      const part = group.parts[instanceId % group.parts.length];
      return { body: part.slot - 1, instance: Math.floor(instanceId / group.parts.length) };
    },
  };
}

function groupsOf(recording) {
  const groups = new Map();
  for (const part of recording.parts) {
    if (part.layer === layerNames.indexOf('ground')) continue;
    const mirrored = new Matrix4().fromArray(part.place).determinant() < 0;
    const opacity = Math.min(1, Math.max(0, part.colour[3]));
    const key = `${part.layer} ${part.mesh} ${opacity} ${mirrored}`;
    if (!groups.has(key)) groups.set(key, { layer: part.layer, mesh: part.mesh, opacity, mirrored, parts: [] });
    groups.get(key).parts.push(part);
  }
  return [...groups.values()];
}

/** A mesh as three.js draws it; where a place mirrors it, its triangles turn the other way round. */
export function geometryOf({ positions, normals, indices }, mirrored) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(normals, 3));
  let order = indices;
  if (mirrored) {
    order = indices.slice();
    for (let t = 0; t < order.length; t += 3) [order[t], order[t + 1]] = [order[t + 1], order[t]];
  }
  geometry.setIndex(new BufferAttribute(order, 1));
  geometry.computeBoundingSphere();
  return geometry;
}

/** The box around a mesh. */
function boxAround({ positions }, mirrored) {
  const around = new Box3().setFromArray(positions);
  const side = around.getSize(new Vector3());
  const box = new BoxGeometry(side.x, side.y, side.z);
  box.translate(...around.getCenter(new Vector3()).toArray());
  return geometryOf({ positions: box.attributes.position.array, normals: box.attributes.normal.array, indices: box.index.array }, mirrored);
}

function drawnGroup(group, recording) {
  const mesh = recording.meshes[group.mesh];
  // from both sides: meshes of robots are often open, or inside out
  const material = new MeshStandardMaterial({ roughness: 0.62, metalness: 0, side: DoubleSide, forceSinglePass: true });
  const count = group.parts.length;
  const object = new InstancedMesh(geometryOf(mesh, group.mirrored), material, count * recording.instances);
  object.frustumCulled = false;
  object.receiveShadow = true;
  object.matrixAutoUpdate = false;
  object.boundingSphere = new Sphere(new Vector3(), Infinity);  // what moves is not measured anew for each click
  const places = new Float32Array(16 * count);
  const ownSlots = new Int32Array(count);
  const colours = group.parts.map(({ colour }) => new Color().setRGB(colour[0], colour[1], colour[2], SRGBColorSpace));
  group.parts.forEach((part, p) => {
    places.set(part.place, 16 * p);
    ownSlots[p] = part.slot;
  });
  for (let i = 0; i < recording.instances; ++i) colours.forEach((colour, p) => object.setColorAt(i * count + p, colour));
  const detailed = object.geometry;
  const many = mesh.indices.length / 3 * object.count > manyTriangles;
  const matrix = new Matrix4();
  const scale = group.parts.reduce((most, { place }) => Math.max(most, matrix.fromArray(place).getMaxScaleOnAxis()), 0);
  const { center, radius } = detailed.boundingSphere;
  const extent = scale * (center.length() + radius);
  return { ...group, object, places, slots: ownSlots, colours, detailed, plain: many ? boxAround(mesh, group.mirrored) : detailed, extent };
}

function paint(groups, { body, instance }, colour) {
  for (const { object, slots, colours } of groups) {
    for (let p = 0; p < slots.length; ++p) {
      if (slots[p] !== body + 1) continue;
      object.setColorAt(instance * slots.length + p, colour ? colours[p].clone().lerp(colour, 0.75) : colours[p]);
      object.instanceColor.needsUpdate = true;
    }
  }
}

/** Least distance of an instance from the eye. */
function nearest({ instanceMatrix: { array } }, eye) {
  let square = Infinity;
  for (let i = 12; i < array.length; i += 16) {
    square = Math.min(square, (array[i] - eye.x) ** 2 + (array[i + 1] - eye.y) ** 2 + (array[i + 2] - eye.z) ** 2);
  }
  return Math.sqrt(square);
}

/** Rotation and place of each slot from its pose. */
function placesInto(poses, offsets, instances, slots, out) {
  for (let i = 0; i < instances; ++i) {
    const dx = offsets[2 * i];
    const dy = offsets[2 * i + 1];
    for (let s = 0; s < slots; ++s) {
      const o = (i * slots + s) * numbersOfPlace;
      const p = (i * (slots - 1) + s - 1) * poseSize;
      const x = s === 0 ? 0 : poses[p + 3];
      const y = s === 0 ? 0 : poses[p + 4];
      const z = s === 0 ? 0 : poses[p + 5];
      const w = s === 0 ? 1 : poses[p + 6];
      out[o] = 1 - 2 * (y * y + z * z);
      out[o + 1] = 2 * (x * y - z * w);
      out[o + 2] = 2 * (x * z + y * w);
      out[o + 4] = 2 * (x * y + z * w);
      out[o + 5] = 1 - 2 * (x * x + z * z);
      out[o + 6] = 2 * (y * z - x * w);
      out[o + 8] = 2 * (x * z - y * w);
      out[o + 9] = 2 * (y * z + x * w);
      out[o + 10] = 1 - 2 * (x * x + y * y);
      out[o + 3] = dx + (s === 0 ? 0 : poses[p]);
      out[o + 7] = dy + (s === 0 ? 0 : poses[p + 1]);
      out[o + 11] = s === 0 ? 0 : poses[p + 2];
    }
  }
}

/** Place of its slot times place of the part, column by column. */
function matricesInto({ object, places, slots: ownSlots }, slotPlaces, instances, slots) {
  const matrices = object.instanceMatrix.array;
  const count = ownSlots.length;
  for (let i = 0, out = 0; i < instances; ++i) {
    for (let p = 0; p < count; ++p) {
      const a = (i * slots + ownSlots[p]) * numbersOfPlace;
      for (let column = 0; column < 4; ++column, out += 4) {
        const b = 16 * p + 4 * column;
        for (let row = 0; row < 3; ++row) {
          const r = a + 4 * row;
          matrices[out + row] = slotPlaces[r] * places[b] + slotPlaces[r + 1] * places[b + 1] + slotPlaces[r + 2] * places[b + 2]
            + (column === 3 ? slotPlaces[r + 3] : 0);
        }
        matrices[out + 3] = column === 3 ? 1 : 0;
      }
    }
  }
  object.instanceMatrix.needsUpdate = true;
}
