// The ground: a grid without end that fades out far away and takes shadows; terrain, and all planes but one that is level, as the meshes that they
// are.
import {
  Color, DoubleSide, Group, Matrix4, Mesh, MeshStandardMaterial, PlaneGeometry, ShaderMaterial, ShadowMaterial, SRGBColorSpace, Vector3,
} from 'three';
import { geometryOf } from './bodies.js';

const groundLayer = 3;

/** Lines of a grid in the world's x and y, as thin as a pixel wherever they are. */
const gridLines = `
  float gridLine(vec2 place, float cell) {
    vec2 across = fwidth(place / cell);
    vec2 off = abs(fract(place / cell - 0.5) - 0.5) / max(across, 1e-6);
    float line = 1.0 - min(min(off.x, off.y), 1.0);
    return line * (1.0 - smoothstep(0.15, 0.5, max(across.x, across.y)));  // closer than two pixels they are a grey
  }`;

function gridMaterial() {
  return new ShaderMaterial({
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
    uniforms: {
      centre: { value: new Vector3() }, radius: { value: 1 }, minor: { value: 0.1 }, major: { value: 1 },
      floorColour: { value: new Color() }, lineColour: { value: new Color() },
    },
    vertexShader: `
      varying vec3 place;
      void main() {
        vec4 world = modelMatrix * vec4(position, 1.0);
        place = world.xyz;
        gl_Position = projectionMatrix * viewMatrix * world;
      }`,
    fragmentShader: `
      varying vec3 place;
      uniform vec3 centre, floorColour, lineColour;
      uniform float radius, minor, major;
      ${gridLines}
      void main() {
        float line = max(0.35 * gridLine(place.xy, minor), 0.9 * gridLine(place.xy, major));
        float far = length(place.xy - centre.xy) / radius;
        line *= 1.0 - smoothstep(0.05, 0.5, far);
        gl_FragColor = vec4(mix(floorColour, lineColour, line), 1.0 - smoothstep(0.1, 1.0, far));
        #include <colorspace_fragment>
      }`,
  });
}

/** Distances of lines [m] for a thing of this size. */
export function gridCells(size) {
  const power = 10 ** Math.floor(Math.log10(size / 2));
  const minor = size / 2 >= 5 * power ? power : power / 5;
  return { minor, major: minor === power ? 10 * power : power };
}

/** The height of a part that is a level plane, or NaN. */
function levelOf(part, mesh) {
  const matrix = new Matrix4().fromArray(part.place);
  const point = new Vector3();
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < mesh.positions.length; i += 3) {
    point.fromArray(mesh.positions, i).applyMatrix4(matrix);
    low = Math.min(low, point.z);
    high = Math.max(high, point.z);
  }
  return high - low < 1e-6 ? low : NaN;
}

export function makeGround(recording, { size, whole }) {
  const object = new Group();
  const parts = recording.parts.filter((part) => part.layer === groundLayer);
  const levels = parts.map((part) => levelOf(part, recording.meshes[part.mesh]));
  const first = levels.findIndex((height) => !Number.isNaN(height));
  const level = levels[first];
  const terrain = parts.filter((_, p) => p !== first);
  const { minor, major } = gridCells(size);

  const plane = new PlaneGeometry(2, 2);
  const grid = new Mesh(plane, gridMaterial());
  const shadow = new Mesh(plane, new ShadowMaterial({ depthWrite: false }));
  grid.renderOrder = -2;
  shadow.renderOrder = -1;
  shadow.receiveShadow = true;
  const height = level ?? Math.min(...whole.map((box) => box.min.z));
  if (level !== undefined || terrain.length === 0) object.add(grid, shadow);
  grid.material.uniforms.minor.value = minor;
  grid.material.uniforms.major.value = major;

  const hills = terrain.map((part) => drawnTerrain(part, recording, { minor, major }));
  return {
    object,
    /** Terrain once for each place where instances stand. */
    arrange(offsets, sideBySide) {
      for (const hill of hills) object.remove(...hill.shown.splice(0));
      const copies = sideBySide ? recording.instances : 1;
      for (const hill of hills) {
        for (let i = 0; i < copies; ++i) {
          const mesh = new Mesh(hill.geometry, hill.material);
          mesh.receiveShadow = true;
          mesh.matrixAutoUpdate = false;
          mesh.matrix.makeTranslation(offsets[2 * i], offsets[2 * i + 1], 0).multiply(hill.place);
          hill.shown.push(mesh);
          object.add(mesh);
        }
      }
    },
    /** Keeps the grid around what the camera looks at. */
    centre(target, distance) {
      const radius = 8 * distance;
      for (const mesh of [grid, shadow]) {
        mesh.position.set(target.x, target.y, height);
        mesh.scale.setScalar(radius);
      }
      grid.material.uniforms.centre.value.copy(target);
      grid.material.uniforms.radius.value = radius;
    },
    colour({ floor, line, shadow: strength }) {
      grid.material.uniforms.floorColour.value.set(floor);
      grid.material.uniforms.lineColour.value.set(line);
      shadow.material.opacity = strength;
      for (const { material, own } of hills) material.color.copy(own);
    },
  };
}

function drawnTerrain(part, recording, { minor, major }) {
  const place = new Matrix4().fromArray(part.place);
  const own = new Color().setRGB(part.colour[0], part.colour[1], part.colour[2], SRGBColorSpace);
  const material = new MeshStandardMaterial({ color: own, roughness: 0.9, side: DoubleSide });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace('void main() {', 'varying vec2 groundPlace;\nvoid main() {')
      .replace('#include <begin_vertex>', '#include <begin_vertex>\n  groundPlace = (modelMatrix * vec4(position, 1.0)).xy;');
    shader.fragmentShader = shader.fragmentShader.replace('void main() {', `varying vec2 groundPlace;\n${gridLines}\nvoid main() {`)
      .replace('#include <color_fragment>', `#include <color_fragment>
        float line = max(0.4 * gridLine(groundPlace, ${minor.toFixed(6)}), gridLine(groundPlace, ${major.toFixed(6)}));
        diffuseColor.rgb *= 1.0 - 0.3 * line;`);
  };
  const geometry = geometryOf(recording.meshes[part.mesh], place.determinant() < 0);
  return { geometry, material, own, place, shown: [] };
}
