// What an address asks for: page.html#t=1.5&chrome=0&theme=dark&azimuth=30&elevation=20&follow=pelvis&layers=visual,frames
//
//   t            [s] moment, paused; play=1 plays from there
//   chrome       0 hides all panels
//   theme        light, dark
//   azimuth, elevation [deg], distance [m], target=x,y,z [m], follow=body or body,instance
//   layers       names of all that is shown
//   arrangement  beside, overlaid
//   body         that is chosen, or body,instance
//   speed, loop

export function readAddress(hash) {
  const asked = new URLSearchParams(hash.replace(/^#/, ''));
  const number = (name) => {
    const value = asked.has(name) && asked.get(name).trim() !== '' ? Number(asked.get(name)) : NaN;
    return Number.isFinite(value) ? value : undefined;
  };
  const yes = (name) => (asked.has(name) ? !['0', 'false', 'no'].includes(asked.get(name)) : undefined);
  const target = asked.get('target')?.split(',').map(Number);
  return {
    seconds: number('t'),
    play: yes('play'),
    chrome: yes('chrome'),
    theme: ['light', 'dark'].includes(asked.get('theme')) ? asked.get('theme') : undefined,
    view: {
      azimuth: number('azimuth'),
      elevation: number('elevation'),
      distance: number('distance'),
      target: target?.length === 3 && target.every(Number.isFinite) ? target : undefined,
    },
    follow: asked.get('follow') ?? undefined,
    body: asked.get('body') ?? undefined,
    layers: asked.get('layers')?.split(','),
    arrangement: asked.get('arrangement') ?? undefined,
    speed: number('speed'),
    loop: yes('loop'),
  };
}

/** {body, instance} of a name, a number, or `name,instance`; null where there is none. */
export function bodyNamed(recording, asked) {
  if (asked === null || asked === undefined || asked === '') return null;
  const text = String(asked);
  const found = (name) => {
    const body = recording.bodies.indexOf(name);
    if (body >= 0) return body;
    return /^\d+$/.test(name) && Number(name) < recording.bodies.length ? Number(name) : -1;
  };
  let [body, instance] = [found(text), 0];
  const split = /^(.*),(\d+)$/s.exec(text);
  if (body < 0 && split) [body, instance] = [found(split[1]), Number(split[2])];
  return body >= 0 && instance < recording.instances ? { body, instance } : null;
}
