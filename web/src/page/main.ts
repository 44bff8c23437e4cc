/** Starts the page once the core is unpacked from the file itself. */

import { Core } from '../core';
import { App } from './app';
import { h } from './dom';
import { say } from './words';

function followTheme(): void {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const apply = () => document.body.classList.toggle('body--dark', dark.matches);
  dark.addEventListener('change', apply);
  apply();
}

async function core(): Promise<Core> {
  const packed = Uint8Array.from(atob(document.getElementById('core')!.textContent!.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return Core.of(await new Response(stream).arrayBuffer());
}

followTheme();
const root = document.getElementById('app')!;
try {
  new App(root, await core());
  document.body.dataset.ready = 'true';
  performance.mark('ready');
} catch (error) {
  root.replaceChildren(h('p', { class: 'trouble', role: 'alert' }, say('This browser cannot run the page: it needs WebAssembly and unpacking of gzip. Take a newer one.')));
  throw error;
}
