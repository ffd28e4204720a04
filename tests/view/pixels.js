// Pictures as numbers, and colours as the guidelines for readable text measure them.
import { inflateSync } from 'node:zlib';

/** Pixels of a PNG file of eight bits a channel, without interlacing: {width, height, at(x, y) -> [r, g, b]}. */
export function readPng(file) {
  let [at, width, height, channels] = [8, 0, 0, 0];
  const packed = [];
  while (at < file.length) {
    const length = file.readUInt32BE(at);
    const kind = file.toString('latin1', at + 4, at + 8);
    const body = file.subarray(at + 8, at + 8 + length);
    if (kind === 'IHDR') {
      [width, height, channels] = [body.readUInt32BE(0), body.readUInt32BE(4), body[9] === 6 ? 4 : 3];
    } else if (kind === 'IDAT') packed.push(body);
    at += 12 + length;
  }
  const bytes = inflateSync(Buffer.concat(packed));
  const stride = width * channels;
  const pixels = Buffer.alloc(height * stride);
  for (let y = 0; y < height; ++y) {
    const filter = bytes[y * (stride + 1)];
    for (let x = 0; x < stride; ++x) {
      const left = x >= channels ? pixels[y * stride + x - channels] : 0;
      const above = y > 0 ? pixels[(y - 1) * stride + x] : 0;
      const corner = x >= channels && y > 0 ? pixels[(y - 1) * stride + x - channels] : 0;
      const guess = [0, left, above, (left + above) >> 1, paeth(left, above, corner)][filter];
      pixels[y * stride + x] = bytes[y * (stride + 1) + 1 + x] + guess;
    }
  }
  return { width, height, at: (x, y) => [0, 1, 2].map((k) => pixels[y * stride + x * channels + k]) };
}

function paeth(left, above, corner) {
  const [a, b, c] = [Math.abs(above - corner), Math.abs(left - corner), Math.abs(left + above - 2 * corner)];
  return a <= b && a <= c ? left : b <= c ? above : corner;
}

/** Middle of all pixels whose colour is told by `wanted`, and how many they are. */
export function middleOf(picture, wanted) {
  let [x, y, count] = [0, 0, 0];
  for (let row = 0; row < picture.height; ++row) {
    for (let column = 0; column < picture.width; ++column) {
      if (!wanted(picture.at(column, row))) continue;
      x += column + 0.5;
      y += row + 0.5;
      ++count;
    }
  }
  return { x: x / count, y: y / count, count };
}

/** Contrast of two colours [r, g, b] of 0 to 255 (WCAG 2.2). */
export function contrast(a, b) {
  const luminance = (colour) => {
    const [r, g, b] = colour.map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [dark, light] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (light + 0.05) / (dark + 0.05);
}
