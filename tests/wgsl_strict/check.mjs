// Compiles every shader with Tint, the WGSL compiler of Chromium, and makes each entry point a pipeline. No adapter is
// needed. Warnings count as errors.
//
//   npm ci --prefix tests/wgsl_strict && node tests/wgsl_strict/check.mjs
import { readFileSync } from 'node:fs';
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

/// Whether a fragment shader with this result, as `-> type`, writes colours.
function returnsColours(code, gives) {
  const structName = gives?.match(/->\s*(\w+)\s*$/)?.[1];
  const fields = structName && code.match(new RegExp(`struct\\s+${structName}\\s*\\{([^}]*)\\}`))?.[1];
  return (fields ?? gives ?? '').includes('@location');
}

/// Makes an entry point a pipeline: what is known only then (override constants, limits, interfaces) is checked.
async function link(name, module, { stage, entry: entryPoint }, fragment) {
  device.pushErrorScope('validation');
  const layout = 'auto';
  if (stage === 'compute') {
    device.createComputePipeline({ layout, compute: { module, entryPoint } });
  } else {
    // What is beside the place of a corner: a colour, or a number.
    const beside = { LINE: 'unorm8x4', PAINTER: 'uint32' }[name];
    const buffers = beside ? [{
      arrayStride: 16,
      attributes: [
        { shaderLocation: 0, offset: 0, format: 'float32x3' },
        { shaderLocation: 1, offset: 12, format: beside },
      ],
    }] : [];
    // A fragment shader without colours writes only depth, or only lets pixels through.
    const targets = fragment?.colours ? [{ format: 'rgba16float' }] : [];
    device.createRenderPipeline({
      layout,
      vertex: { module, entryPoint, buffers },
      fragment: fragment && { module, entryPoint: fragment.entry, targets },
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

// Shaders are made of files as the crate says.
const folder = new URL('../../crates/osp-render/src/', import.meta.url);
const list = readFileSync(new URL('shaders.rs', folder), 'utf8');
const shaders = [...list.matchAll(/const (\w+): &str =\s*((?:concat!\()?\s*include_str![^;]*);/g)].map(([, name, value]) => {
  const files = [...value.matchAll(/"([^"]+\.wgsl)"/g)].map((m) => m[1]);
  return [name, files.map((file) => readFileSync(new URL(file, folder), 'utf8')).join('')];
});
let entries = 0;
for (const [name, code] of shaders) {
  const { module, messages } = await compile(name, code);
  messages.forEach(fail);
  if (messages.length > 0) continue;
  const pattern = /@(vertex|fragment|compute)\b[^{]*?\bfn\s+(\w+)\s*\(([^{]*?)\)\s*(->[^{]*)?\{/g;
  const found = [...code.matchAll(pattern)].map(([, stage, entry, takes, gives]) => ({ stage, entry, takes, gives }));
  const fragments = found.filter(({ stage }) => stage === 'fragment');
  for (const one of fragments) one.colours = returnsColours(code, one.gives);
  for (const one of found.filter(({ stage }) => stage !== 'fragment')) {
    // A fragment shader takes what its vertex shader gives; one that only lays down depth may have none.
    const type = one.gives?.match(/->\s*(\w+)\s*$/)?.[1];
    const partners = fragments.filter(({ takes }) => one.stage === 'vertex' && takes.endsWith(`: ${type}`));
    for (const fragment of partners.length > 0 ? partners : [undefined]) await link(name, module, one, fragment);
    for (const fragment of partners) fragment.isLinked = true;
  }
  fragments.filter(({ isLinked }) => !isLinked).forEach(({ entry }) => fail(`${name}: ${entry}: no vertex shader for it`));
  entries += found.length;
}
if (shaders.length < 11 || entries < 30) fail(`only ${shaders.length} shaders and ${entries} entry points were found`);
console.log(`Tint: ${shaders.length} shaders, ${entries} entry points, ${failures} failures`);
process.exit(failures > 0 ? 1 : 0);
