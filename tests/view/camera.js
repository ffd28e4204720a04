// A camera's own mathematics, which shares nothing with the page's.
const minus = (a, b) => a.map((value, k) => value - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / Math.hypot(...a));

/** Pixel of a point seen by a camera that looks at its target, z up. */
export function seen(point, { azimuth, elevation, distance, target, fov }, { x, y, width, height }) {
  const [a, e] = [azimuth, elevation].map((degrees) => degrees * Math.PI / 180);
  const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  const eye = target.map((value, k) => value + distance * back[k]);
  const right = unit(cross([0, 0, 1], back));
  const up = cross(back, right);
  const ray = minus(point, eye);
  const scale = height / 2 / Math.tan(fov * Math.PI / 360) / -dot(ray, back);
  return { x: x + width / 2 + scale * dot(ray, right), y: y + height / 2 - scale * dot(ray, up) };
}

export const canvasBox = (page) => page.evaluate(() => {
  const { x, y, width, height } = document.getElementById('view').getBoundingClientRect();
  return { x, y, width, height };
});

export const off = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
