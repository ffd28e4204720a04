// All that is seen: poses of the moment, the scene made of them, and the camera. It draws when asked to, and tells `changed` when there is
// something new to draw.
import { Color, Vector3 } from 'three';
import { makeArrows } from './arrows.js';
import { makeAxes } from './axes.js';
import { makeBodies } from './bodies.js';
import { makeCamera } from './camera.js';
import { boxOfAll, extentOf, offsetsOf } from './extent.js';
import { makeGround } from './ground.js';
import { makeLines } from './lines.js';
import { momentOf, poseSize } from './recording.js';
import { makePullLines } from './pulling.js';
import { makeStage, themes } from './stage.js';
import { makeThreads } from './threads.js';

const place = new Vector3();  // of what is looked up

export class View {
  selection = null;  // {body, instance}
  follow = null;     // {body, instance}
  seconds = 0;
  layers = { visual: true, collision: false, inertia: false, frames: false, forces: false, ground: true, shadows: true };
  #theme = themes.light;
  #area = [0, 0, 0];  // width, height, pixels of the screen in one of the page
  #moved = true;      // since poses were read last

  constructor(canvas, recording, changed) {
    this.canvas = canvas;
    this.recording = recording;
    this.changed = changed;
    this.stage = makeStage(canvas);
    this.extent = extentOf(recording);
    this.poses = new Float32Array(recording.instances * recording.bodies.length * poseSize);
    recording.poseInto({ frame: 0, fraction: 0 }, this.poses);
    this.bodies = makeBodies(recording);
    this.ground = makeGround(recording, this.extent);
    this.axes = makeAxes(recording, this.extent.size, this.poses);
    this.arrows = makeArrows(recording, this.extent.size);
    this.threads = makeThreads(recording);
    this.lines = makeLines(recording);
    this.pullLines = recording.live ? makePullLines(recording) : null;
    this.camera = makeCamera(canvas, changed);
    this.stage.scene.add(this.ground.object, this.arrows.object, this.threads.object, this.lines.object, ...this.bodies.groups.map(({ object }) => object));
    if (this.pullLines) this.stage.scene.add(this.pullLines.object);
    const hasLayer = (layer) => recording.parts.some((part) => part.layer === layer);
    /** Layers that this recording has something of. */
    this.offered = {
      visual: hasLayer(0), collision: hasLayer(1), inertia: hasLayer(2), frames: recording.bodies.length > 0,
      forces: recording.mostForces > 0, ground: true, shadows: true,
    };
    this.#place(recording.instances > 1);
  }

  get newtonPerMetre() { return this.arrows.newtonPerMetre; }
  get renderer() { return this.stage.renderer; }

  #place(sideBySide) {
    this.sideBySide = sideBySide;
    this.offsets = offsetsOf(this.extent, sideBySide);
    this.ground.arrange(this.offsets, sideBySide);
    this.sceneRadius = 0.5 * boxOfAll(this.extent.whole, this.offsets).getSize(place).length();
    this.#moved = true;
  }

  #update() {
    const moment = momentOf(this.recording.times, this.seconds);
    this.recording.poseInto(moment, this.poses);
    this.bodies.place(this.poses, this.offsets);
    this.axes.place(this.bodies.places, this.bodies.slots);
    this.arrows.place(moment.frame, this.offsets);
    this.threads.place(this.bodies.places, this.bodies.slots);
    this.lines.place(this.bodies.places, this.bodies.slots);
    this.pullLines?.place();
    this.camera.carry(this.follow ? this.bodies.originInto(this.follow.body, this.follow.instance, place) : null);
    this.#moved = false;
  }

  #restart() {
    this.#moved = true;
    this.changed();
  }

  goTo(seconds) {
    this.seconds = seconds;
    this.#restart();
  }

  show(layers) {
    Object.assign(this.layers, layers);
    for (const name of Object.keys(this.offered)) if (!this.offered[name]) this.layers[name] = false;
    this.bodies.show(this.layers);
    this.axes.show(this.layers.frames);
    if (this.layers.frames) this.stage.scene.add(this.axes.object());
    this.arrows.object.visible = this.layers.forces;
    this.lines.show(this.layers);
    this.ground.object.visible = this.layers.ground;
    this.stage.shadows(this.layers.shadows);
    this.#restart();
  }

  arrange(sideBySide) {
    this.#place(sideBySide && this.recording.instances > 1);
    this.home();
  }

  select(selection) {
    this.selection = selection;
    this.bodies.mark(selection, new Color(this.#theme.mark));
    this.#restart();
  }

  setFollow(follow) {
    this.follow = follow;
    this.camera.carry(null);
    this.#restart();
  }

  /** Looks at all of the motion; where it goes far, at its beginning, and goes along with the first body. */
  home() {
    const first = boxOfAll(this.extent.first, this.offsets);
    const origins = boxOfAll(this.extent.origins, this.offsets).union(first);
    const far = origins.getSize(new Vector3()).length() > 2.5 * first.getSize(new Vector3()).length();
    this.camera.fit(far ? first : origins);
    if (far && !this.follow) this.follow = { body: 0, instance: 0 };
    this.camera.carry(null);
    this.#restart();
  }

  colour(name) {
    this.#theme = themes[name];
    this.stage.colour(this.#theme);
    this.ground.colour(this.#theme);
    this.arrows.colour(this.#theme);
    this.threads.colour(this.#theme);
    this.lines.colour(this.#theme);
    this.pullLines?.colour(this.#theme);
    this.bodies.mark(this.selection, new Color(this.#theme.mark));
    this.changed();
  }

  /** Fills an area of these pixels; says whether that is a change. */
  resize(width, height, ratio) {
    if (width === 0 || height === 0 || [width, height, ratio].every((value, k) => value === this.#area[k])) return false;
    this.#area = [width, height, ratio];
    this.stage.resize(width, height, ratio);
    this.camera.resize(width, height);
    this.changed();
    return true;
  }

  /** Draws the moment, now. */
  draw() {
    const { camera } = this.camera;
    const pixels = 0.5 * this.canvas.clientHeight / Math.tan(camera.fov * Math.PI / 360);  // of a metre at a distance of a metre
    const threaded = this.threads.object.visible;
    this.threads.show(this.layers, pixels / this.camera.angles().distance);
    if (this.#moved || this.threads.object.visible !== threaded) this.#update();
    const { distance } = this.camera.angles();
    this.camera.reach(this.sceneRadius);
    this.bodies.simplify(camera.position, pixels, this.threads.object.visible);
    this.ground.centre(this.camera.target, distance);
    this.stage.light(this.camera.target, Math.min(1.2 * this.sceneRadius, 1.5 * distance));
    this.stage.renderer.render(this.stage.scene, camera);
  }

  /** Place of a body's origin in pixels of the page; `behind` where it is behind the camera. */
  project(body, instance) {
    if (this.#moved) this.#update();
    const { camera } = this.camera;
    camera.updateMatrixWorld();
    this.bodies.originInto(body, instance, place).project(camera);
    const box = this.canvas.getBoundingClientRect();
    return { x: box.left + (place.x + 1) / 2 * box.width, y: box.top + (1 - place.y) / 2 * box.height, behind: place.z > 1 };
  }

  /** Numbers of a body's pose, without the offset of its instance. */
  poseOf(body, instance) {
    if (this.#moved) this.#update();
    const o = (instance * this.recording.bodies.length + body) * poseSize;
    return this.poses.subarray(o, o + poseSize);
  }
}
