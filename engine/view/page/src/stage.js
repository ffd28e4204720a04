// The stage: what draws, the lights with their shadows, and the colours of a theme. It draws when asked to.
import {
  AmbientLight, Color, DirectionalLight, HemisphereLight, NeutralToneMapping, PCFShadowMap, Scene, Vector3, WebGLRenderer,
} from 'three';
import { DataError } from './data.js';

export const themes = {
  light: {
    sky: '#f3f3f0', floor: '#e7e7e3', line: '#c3c4c0', shadow: 0.2, bounce: '#b9b5ad', ambient: 0.85, force: '#d2541b', mark: '#e08a00',
    thread: '#2f5d8a', cable: '#3d3a36',
  },
  dark: {
    sky: '#15171a', floor: '#1e2124', line: '#3a3f44', shadow: 0.42, bounce: '#3c4046', ambient: 0.6, force: '#ff8a4c', mark: '#ffb02e',
    thread: '#8fb8de', cable: '#c9c4ba',
  },
};

function contextOf(canvas) {
  const context = canvas.getContext('webgl2', { antialias: true, alpha: false, powerPreference: 'high-performance' });
  if (!context) throw new DataError('This browser cannot draw in three dimensions here: WebGL 2 is missing or switched off.');
  return context;
}

export function makeStage(canvas) {
  const renderer = new WebGLRenderer({ canvas, context: contextOf(canvas) });
  renderer.toneMapping = NeutralToneMapping;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  const scene = new Scene();
  scene.background = new Color();

  const sky = new HemisphereLight('#ffffff', '#b9b5ad', 1.5);
  sky.position.set(0, 0, 1);
  const ambient = new AmbientLight('#ffffff', 0.3);
  const key = new DirectionalLight('#fff6ea', 2.5);
  const rim = new DirectionalLight('#dfe9ff', 0.7);
  key.castShadow = true;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.radius = 2.5;
  scene.add(sky, ambient, key, key.target, rim, rim.target);
  const towards = new Vector3(0.45, -0.55, 1.1).normalize();
  const back = new Vector3(-0.6, 0.7, 0.35).normalize();

  /** Light falls around this place, with shadows within the radius. */
  const light = (place, radius) => {
    key.target.position.copy(place);
    key.position.copy(place).addScaledVector(towards, 2 * radius);
    rim.target.position.copy(place);
    rim.position.copy(place).addScaledVector(back, 2 * radius);
    const { camera } = key.shadow;
    if (camera.right !== radius) {
      [camera.left, camera.right, camera.bottom, camera.top] = [-radius, radius, -radius, radius];
      [camera.near, camera.far] = [0.05 * radius, 5 * radius];
      camera.updateProjectionMatrix();
      key.shadow.normalBias = 3 * radius / key.shadow.mapSize.x;
      key.shadow.bias = -0.0004;
    }
  };

  return {
    renderer,
    scene,
    light,
    colour(theme) {
      scene.background.set(theme.sky);
      sky.groundColor.set(theme.bounce);
      sky.intensity = 2.1 * theme.ambient;
      ambient.intensity = 0.5 * theme.ambient;
    },
    shadows(shown) {
      key.castShadow = shown;
    },
    resize(width, height, ratio) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height, false);
    },
  };
}
