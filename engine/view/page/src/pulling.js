// Pulling at bodies of a running simulation: with shift, or in pulling mode, a press on a body draws it to the pointer by a spring, in the
// plane through the place that was pressed. In pulling mode arrow keys draw the chosen body.
import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Plane, Points, PointsMaterial, Quaternion, Raycaster, Vector2, Vector3 } from 'three';
import { bodyAt } from './picking.js';

const mostPulls = 64;
const numbersOfPull = 7;
const keyStride = 0.03;  // of the distance to what is looked at

/** Lines from where bodies are held to where they are drawn to, whoever draws them. */
export function makePullLines(source) {
  const positions = new Float32Array(6 * mostPulls);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  const line = new LineBasicMaterial({ depthTest: false, transparent: true, toneMapped: false });
  const ends = new PointsMaterial({ size: 9, sizeAttenuation: false, depthTest: false, transparent: true, toneMapped: false });
  const object = new Group();
  for (const part of [new LineSegments(geometry, line), new Points(geometry, ends)]) {
    part.frustumCulled = false;
    part.renderOrder = 6;
    part.raycast = () => {};
    object.add(part);
  }
  return {
    object,
    place() {
      const count = Math.min(mostPulls, source.pulls.length / numbersOfPull);
      object.visible = count > 0;
      for (let p = 0; p < count; ++p) positions.set(source.pulls.subarray(numbersOfPull * p + 1, numbersOfPull * (p + 1)), 6 * p);
      geometry.setDrawRange(0, 2 * count);
      geometry.attributes.position.needsUpdate = true;
    },
    colour(theme) {
      line.color.set(theme.mark);
      ends.color.set(theme.mark);
    },
  };
}

/** Watches the canvas. Returns {mode, setMode, release}. */
export function watchPulls(canvas, view, source, stream) {
  const ray = new Raycaster();
  const plane = new Plane();
  const [to, along, turn] = [new Vector3(), new Vector3(), new Quaternion()];
  let pull = null;    // {body, point: in its frame, pointer: its number, or null}
  let asked = false;  // for a frame of the browser
  const pulling = { mode: false, setMode, release };

  function setMode(mode) {
    pulling.mode = mode;
    canvas.classList.toggle('pulling', mode);
    if (!mode) release();
  }
  function release() {
    if (!pull) return;
    pull = null;
    stream.send({ do: 'release' });
  }
  /** Tells where the pull goes, once for each picture that is drawn. */
  function tell() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      if (pull) stream.send({ do: 'pull', body: pull.body, point: pull.point, to: to.toArray() });
    });
  }
  /** A place of the world in the frame of a body. */
  function inBody(body, place) {
    const pose = view.poseOf(body, 0);
    return place.clone().sub(along.fromArray(pose)).applyQuaternion(turn.fromArray(pose, 3).invert()).toArray();
  }
  function follow({ clientX, clientY }) {
    const box = canvas.getBoundingClientRect();
    ray.setFromCamera(new Vector2((clientX - box.left) / box.width * 2 - 1, 1 - (clientY - box.top) / box.height * 2), view.camera.camera);
    if (ray.ray.intersectPlane(plane, along)) to.copy(along);
    tell();
  }
  function begin(body, place, pointer) {
    pull = { body, point: inBody(body, place), pointer };
    view.camera.camera.getWorldDirection(along);
    plane.setFromNormalAndCoplanarPoint(along, place);
    to.copy(place);
  }

  // before the camera's controls, which would turn
  canvas.addEventListener('pointerdown', (event) => {
    if (!event.isPrimary || event.button !== 0 || !(event.shiftKey || pulling.mode) || !stream.connected) return;
    const found = bodyAt(event.clientX, event.clientY, { canvas, camera: view.camera.camera, bodies: view.bodies, recording: source });
    if (!found) return;
    event.stopImmediatePropagation();
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    begin(found.body, found.point, event.pointerId);
    follow(event);
  }, { capture: true });
  canvas.addEventListener('pointermove', (event) => {
    if (pull?.pointer !== event.pointerId) return;
    event.stopImmediatePropagation();
    follow(event);
  }, { capture: true });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    canvas.addEventListener(name, (event) => {
      if (pull?.pointer !== event.pointerId) return;
      event.stopImmediatePropagation();
      release();
    }, { capture: true });
  }

  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  canvas.addEventListener('keydown', (event) => {
    if (pull && event.key === 'Escape') {
      release();
      event.preventDefault();
    }
    const arrow = arrows[event.key];
    if (!arrow || !pulling.mode || !view.selection || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const { body } = view.selection;
    if (pull?.body !== body) begin(body, new Vector3().fromArray(view.poseOf(body, 0)), null);
    const { camera, angles } = view.camera;
    const stride = keyStride * angles().distance;
    to.addScaledVector(along.setFromMatrixColumn(camera.matrixWorld, 0), stride * arrow[0]);
    to.addScaledVector(along.setFromMatrixColumn(camera.matrixWorld, 1), stride * arrow[1]);
    tell();
  });
  return pulling;
}
