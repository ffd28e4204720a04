// The camera: turns around what it looks at, z up, and may go along with a body.
//
// azimuth    [deg] of the camera around its target, from x towards y
// elevation  [deg] of the camera above its target
// distance   [m] to the target
import { MathUtils, PerspectiveCamera, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

const fieldOfView = 32;  // [deg], of the shorter side
const room = 0.76;       // of the page that a box fills, where its title takes little of it
const bareRoom = 0.86;   // where nothing else is shown
const titleHeight = 75;  // pixels

export function makeCamera(canvas, changed) {
  const camera = new PerspectiveCamera(fieldOfView, 1, 0.01, 1000);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, canvas);
  controls.enableDamping = true;
  controls.dampingFactor = 0.12;
  controls.zoomSpeed = 1.2;
  controls.addEventListener('change', changed);
  const { target } = controls;
  const [offset, last] = [new Vector3(), new Vector3()];
  let carried = false;

  const move = (azimuth, elevation, distance) => {
    const [a, e] = [MathUtils.degToRad(azimuth), MathUtils.degToRad(MathUtils.clamp(elevation, -89.9, 89.9))];
    controls.enableDamping = false;  // what is left of a turn does not go on from the new place
    controls.update();
    controls.enableDamping = true;
    offset.set(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)).multiplyScalar(Math.max(distance, 1e-6));
    camera.position.copy(target).add(offset);
    controls.update();
  };
  const angles = () => {
    offset.copy(camera.position).sub(target);
    return {
      azimuth: MathUtils.radToDeg(Math.atan2(offset.y, offset.x)),
      elevation: MathUtils.radToDeg(Math.asin(MathUtils.clamp(offset.z / (offset.length() || 1), -1, 1))),
      distance: offset.length(),
    };
  };

  return {
    camera,
    controls,
    target,
    angles,
    set({ azimuth, elevation, distance, target: place } = {}) {
      const now = angles();
      if (place) target.fromArray(place);
      move(azimuth ?? now.azimuth, elevation ?? now.elevation, distance ?? now.distance);
    },
    /** Looks at a box from the front, somewhat above, so near that all of it is just seen. */
    fit(box, { azimuth = -55, elevation = 14 } = {}) {
      box.getCenter(target);
      move(azimuth, elevation, 1);
      camera.updateMatrixWorld();
      const turn = camera.quaternion.clone().invert();
      const half = Math.tan(MathUtils.degToRad(camera.fov) / 2);
      const bare = canvas.closest('.bare') !== null;
      const wide = bare ? bareRoom : room;
      const high = bare ? bareRoom : Math.max(0.3, Math.min(room, 1 - 2 * titleHeight / canvas.clientHeight));
      let distance = 0;
      for (let corner = 0; corner < 8; ++corner) {
        offset.set(...['x', 'y', 'z'].map((axis, k) => (corner >> k & 1 ? box.max : box.min)[axis])).sub(target).applyQuaternion(turn);
        const across = Math.max(Math.abs(offset.y) / high, Math.abs(offset.x) / camera.aspect / wide) / half;
        distance = Math.max(distance, across + offset.z);
      }
      move(azimuth, elevation, distance);
    },
    /** Goes along with a place that moves; the first place is looked at. null: stays. */
    carry(place) {
      if (place === null) {
        carried = false;
        return;
      }
      if (!carried) offset.copy(place).sub(target);
      else offset.copy(place).sub(last);
      target.add(offset);
      camera.position.add(offset);
      last.copy(place);
      carried = true;
    },
    resize(width, height) {
      camera.aspect = width / height;
      // of a narrow page the width counts
      const half = Math.tan(MathUtils.degToRad(fieldOfView) / 2);
      camera.fov = MathUtils.radToDeg(2 * Math.atan(camera.aspect < 1 ? half / camera.aspect : half));
      camera.updateProjectionMatrix();
    },
    /** Near and far for a scene of this radius. */
    reach(sceneRadius) {
      const distance = offset.copy(camera.position).sub(target).length();
      camera.near = distance / 200;
      camera.far = 30 * distance + 4 * sceneRadius;
      camera.updateProjectionMatrix();
    },
  };
}
