// What scripts ask of the page: window.linden.
//
//   ready                 a promise of '' once everything is there, or of the sentence that says what is wrong
//   frames, duration [s], bodies [names], instances
//   show(seconds)         pauses and draws this moment, before it returns
//   play(), pause()
//   view({azimuth, elevation [deg], distance [m], target [x, y, z], follow: name, number, 'name,instance' or null})
//                         sets what is given; returns all of it, with the height of what is seen as `fov` [deg]
//   layers({visual, collision, inertia, frames, forces, ground, shadows: true or false})   returns all of them
//   arrange('beside' or 'overlaid')
//   chrome(shown)         panels, or the motion alone
//   theme('light' or 'dark')
//   select(body)          name, number, 'name,instance' or null
//   project(body, instance)   {x, y} of the body's origin in pixels of the page
//   pose(body, instance)      place x y z [m] and quaternion x y z w of the body
//   live()                    of a running simulation {connected, state, seconds, steps, speed, pace, slow, message, refusal, targets, pulls,
//                             frames: that were received}; null of a recording
//   send(command)             of a running simulation: as engine/view/live.hpp has commands
//   statistics()          {triangles, calls, bodies, decodeMilliseconds}: of the picture drawn last, shadows included
import { bodyNamed } from './address.js';
import { byId } from './controls.js';

const liveFacts = ({ received, seconds, steps, pulls }, stream) => ({
  connected: stream.connected, refusal: stream.refusal, ...stream.status, seconds, steps, frames: received, pulls: Array.from(pulls),
});

export function offer({ view, player, recording, actions, theme, fill, draw, decodeMilliseconds, stream }) {
  const known = (asked) => {
    const found = bodyNamed(recording, asked);
    if (!found && asked !== null && asked !== '') throw new RangeError(`there is no body ${JSON.stringify(asked)} in this motion`);
    return found;
  };
  Object.assign(window.linden, {
    frames: recording.frames,
    duration: recording.duration,
    bodies: recording.bodies,
    instances: recording.instances,
    show(seconds) {
      player.pause();
      player.go(seconds);
      draw();
    },
    play: player.play,
    pause: player.pause,
    view({ azimuth, elevation, distance, target, follow } = {}) {
      if (follow !== undefined) view.setFollow(known(follow));
      else if (target) view.setFollow(null);
      view.camera.set({ azimuth, elevation, distance, target });
      draw();
      const { camera, target: place, angles } = view.camera;
      return { ...angles(), target: place.toArray(), follow: view.follow ? recording.bodies[view.follow.body] : null, fov: camera.fov };
    },
    layers(shown = {}) {
      view.show(shown);
      draw();
      return { ...view.layers };
    },
    arrange(how) {
      view.arrange(how !== 'overlaid');
      draw();
    },
    chrome(shown) {
      byId('page').classList.toggle('bare', !shown);
      fill();
      draw();
    },
    theme(name) {
      theme.set(name);
      draw();
    },
    select(body) {
      actions.select(known(body));
      draw();
    },
    project(body, instance = 0) {
      const { x, y } = view.project(known(body).body, instance);
      return { x, y };
    },
    pose: (body, instance = 0) => Array.from(view.poseOf(known(body).body, instance)),
    live: () => (stream ? liveFacts(recording, stream) : null),
    send: (command) => stream?.send(command),
    statistics() {
      const { triangles, calls } = view.renderer.info.render;
      return { triangles, calls, bodies: recording.bodies.length * recording.instances, decodeMilliseconds };
    },
  });
}
