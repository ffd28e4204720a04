// Every binary glTF file of the folder LINDEN_GLB_DIR is what the Khronos Group's validator calls valid: no errors and no warnings. tests/view/run fills the
// folder (tests/engine/glb_files_test.cpp).
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { test } from 'node:test';

const { validateBytes } = createRequire(join(process.env.LINDEN_BUILD, 'view_tests', 'x'))('gltf-validator');

const folder = process.env.LINDEN_GLB_DIR;
const files = folder ? readdirSync(folder).filter((name) => name.endsWith('.glb')) : [];

test('there are glTF files to validate', () => {
  assert.ok(folder, 'LINDEN_GLB_DIR names no folder');
  assert.notEqual(files.length, 0, `there is no .glb in ${folder}`);
});

for (const file of files) {
  test(`${file} is valid glTF`, async () => {
    const report = await validateBytes(new Uint8Array(readFileSync(join(folder, file))), { uri: file, format: 'glb', maxIssues: 20 });
    const { numErrors, numWarnings, messages } = report.issues;
    // severities: 0 error, 1 warning, 2 information, 3 hint
    const told = messages.filter(({ severity }) => severity < 2).map(({ code, message, pointer }) => `${code} at ${pointer}: ${message}`);
    assert.equal(numErrors + numWarnings, 0, told.join('\n'));
  });
}

test('the validator sees what is wrong', async () => {
  const bytes = new Uint8Array(readFileSync(join(folder, files[0])));
  const length = new DataView(bytes.buffer).getUint32(12, true);
  const json = new TextDecoder().decode(bytes.subarray(20, 20 + length)).replace('"asset"', '"azzet"');
  bytes.set(new TextEncoder().encode(json), 20);
  const report = await validateBytes(bytes, { format: 'glb' });
  assert.notEqual(report.issues.numErrors, 0);
});
