// Compiles every shader with Tint, the WGSL compiler of Chromium, and makes each entry point a pipeline. No adapter is
// needed. Warnings count as errors.
//
//   npm ci --prefix tests/wgsl_strict && node tests/wgsl_strict/check.mjs
import { readFileSync, readdirSync } from 'node:fs';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
// The object has to live as long as what comes from it.
const gpu = create(['backend=null']);
const adapter = await gpu.requestAdapter();
if (!adapter) {
  console.error('error: the compiler has no adapter to compile for');
  process.exit(1);
}
const device = await adapter.requestDevice();
// What is wrong is asked for below.
device.addEventListener('uncapturederror', (event) => event.preventDefault());

let failures = 0;
const fail = (text) => {
  failures += 1;
  console.error(text);
};

/// Compiles a shader; whether there was nothing to say about it.
async function compile(name, code) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({ code });
  const { messages } = await module.getCompilationInfo();
  await device.popErrorScope();
  return { module, messages: messages.map((m) => `${name}:${m.lineNum}:${m.linePos}: ${m.type}: ${m.message}`) };
}

/// Makes an entry point a pipeline: what is known only then (override constants, limits, interfaces) is checked.
async function link(name, module, stage, entryPoint, fragment) {
  device.pushErrorScope('validation');
  const layout = 'auto';
  if (stage === 'compute') {
    device.createComputePipeline({ layout, compute: { module, entryPoint } });
  } else {
    const buffers = name === 'line.wgsl' ? [{
      arrayStride: 16,
      attributes: [
        { shaderLocation: 0, offset: 0, format: 'float32x3' },
        { shaderLocation: 1, offset: 12, format: 'unorm8x4' },
      ],
    }] : [];
    const targets = [{ format: 'rgba8unorm-srgb' }];
    device.createRenderPipeline({
      layout,
      vertex: { module, entryPoint, buffers },
      fragment: fragment && { module, entryPoint: fragment, targets },
      depthStencil: { format: 'depth32float', depthWriteEnabled: true, depthCompare: 'greater-equal' },
      multisample: { count: 4 },
    });
  }
  const error = await device.popErrorScope();
  if (error) fail(`${name}: ${entryPoint}: ${error.message}`);
}

// A compiler that refuses nothing would be none.
const refused = await compile('what must be refused', '@compute @workgroup_size(1) fn f() { let a = 1u >> 1u & 1u; }');
if (refused.messages.length === 0) fail('the compiler accepts `>>` beside `&`');

const folder = new URL('../../src/render/shaders/', import.meta.url);
const files = readdirSync(folder).filter((name) => name.endsWith('.wgsl')).sort();
let entries = 0;
for (const name of files) {
  const code = readFileSync(new URL(name, folder), 'utf8');
  const { module, messages } = await compile(name, code);
  messages.forEach(fail);
  if (messages.length > 0) continue;
  const found = [...code.matchAll(/@(vertex|fragment|compute)\b[^{]*?\bfn\s+(\w+)/g)].map((m) => [m[1], m[2]]);
  const fragments = found.filter(([stage]) => stage === 'fragment').map(([, entry]) => entry);
  for (const [stage, entry] of found.filter(([stage]) => stage !== 'fragment')) {
    // A vertex shader that only lays down depth has no fragment shader.
    const isDepthOnly = entry === 'vertex_depth' || fragments.length === 0;
    const partners = stage === 'compute' || isDepthOnly ? [undefined] : fragments;
    for (const fragment of partners) await link(name, module, stage, entry, fragment);
  }
  entries += found.length;
}
if (files.length < 9 || entries < 20) fail(`only ${files.length} shaders and ${entries} entry points were found`);
console.log(`Tint: ${files.length} shaders, ${entries} entry points, ${failures} failures`);
process.exit(failures > 0 ? 1 : 0);
