// Which body is under a pointer: of a press that is let go where it began, as any other turns the camera.
import { Raycaster, Vector2, Vector3 } from 'three';

const nearby = 8;  // pixels from a body's origin, where nothing larger is under the pointer

/** {body, instance, point: where it was met [m]} at a place of the page, or null. */
export function bodyAt(clientX, clientY, { canvas, camera, bodies, recording }) {
  const box = canvas.getBoundingClientRect();
  const place = new Vector2((clientX - box.left) / box.width * 2 - 1, 1 - (clientY - box.top) / box.height * 2);
  const ray = new Raycaster();
  ray.setFromCamera(place, camera);
  const shown = bodies.groups.filter((group) => group.shown).map(({ object }) => object);
  for (const { object, instanceId, point } of ray.intersectObjects(shown, false)) {
    const owner = bodies.owner(object, instanceId);
    if (owner && owner.body >= 0) return { ...owner, point };
  }
  return nearestOrigin(place, box, { camera, bodies, recording });
}

/** The body whose origin is nearest on screen: of links that are thinner than a pixel none is ever hit. */
function nearestOrigin(place, { width, height }, { camera, bodies, recording }) {
  let [found, least] = [null, nearby];
  const origin = new Vector3();
  for (let instance = 0; instance < recording.instances; ++instance) {
    for (let body = 0; body < recording.bodies.length; ++body) {
      const point = bodies.originInto(body, instance, new Vector3());
      origin.copy(point).project(camera);
      const distance = Math.hypot((origin.x - place.x) * width / 2, (origin.y - place.y) * height / 2);
      if (distance < least && origin.z < 1) [found, least] = [{ body, instance, point }, distance];
    }
  }
  return found;
}

/** Calls `clicked` with each press that does not move. */
export function watchClicks(canvas, clicked) {
  let down = null;
  canvas.addEventListener('pointerdown', (event) => {
    down = event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
  });
  canvas.addEventListener('pointerup', (event) => {
    if (down && event.isPrimary && Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5) clicked(event.clientX, event.clientY);
    down = null;
  });
}
