// Makes the page out of src/: one HTML file that loads nothing. `node build.mjs OUT`, where the working folder has node_modules/.
import { createHash } from 'node:crypto';
import { readFile, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [out] = process.argv.slice(2);
if (!out) throw new Error('node build.mjs OUT: says no file to write');
const packages = join(process.cwd(), 'node_modules');
const esbuild = createRequire(join(packages, 'x'))('esbuild');
const source = join(dirname(fileURLToPath(import.meta.url)), 'src');

async function bundle(file) {
  const { outputFiles, metafile } = await esbuild.build({
    entryPoints: [join(source, file)],
    bundle: true,
    minify: true,
    format: 'iife',
    target: 'es2022',
    charset: 'ascii',
    legalComments: 'none',  // licences are written whole, below
    nodePaths: [packages],
    metafile: true,
    write: false,
    logLevel: 'warning',
  });
  return { text: outputFiles[0].text.trim(), inputs: Object.keys(metafile.inputs) };
}

/** The licences of all packages that the bundle has something of. */
async function licencesOf(inputs) {
  const names = new Set(inputs.map((input) => /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input)?.[1]).filter(Boolean));
  const texts = [];
  for (const name of [...names].sort()) {
    const { version } = JSON.parse(await readFile(join(packages, name, 'package.json'), 'utf8'));
    const text = await readFile(join(packages, name, 'LICENSE'), 'utf8');
    texts.push(`This page contains ${name} ${version}:\n\n${text.trim()}`);
  }
  const whole = texts.join('\n\n');
  if (whole.includes('--')) throw new Error('a licence has -- in it, which ends a comment of HTML');
  return `<!--\n${whole}\n-->`;
}

const hashOf = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;

const script = await bundle('main.js');
const style = await bundle('page.css');
const parts = {
  '{script hash}': hashOf(script.text),
  '{style hash}': hashOf(style.text),
  '{style}': style.text,
  '{script}': script.text,
};
let page = await readFile(join(source, 'page.html'), 'utf8');
const licences = await licencesOf([...script.inputs, ...style.inputs]);
page = page.replace('</head>', () => `${licences}\n</head>`);
page = page.replace(/\{(script|style)( hash)?\}/g, (name) => parts[name]);
const places = page.split('\n').filter((line) => line === '<!-- linden data -->');
if (places.length !== 1) throw new Error(`the page has ${places.length} lines for its data, not one`);
await writeFile(out, page);
