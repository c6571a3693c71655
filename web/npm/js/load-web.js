// The WebAssembly beside the package, in browsers and other places with `fetch`. Bundlers know this form of `new URL`.

export async function moduleBeside() {
  const answer = await fetch(new URL("../wasm/osp_culling_bg.wasm", import.meta.url));
  if (!answer.ok) throw new Error(`osp-culling: expected the WebAssembly at ${answer.url}, found status ${answer.status}`);
  // This does not stream, because streaming requires a MIME type that some servers do not send.
  return WebAssembly.compile(await answer.arrayBuffer());
}
