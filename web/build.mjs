// Makes tumble.html: one file that holds the page, its style, its tables and the core, and makes no request.
import { build } from 'esbuild';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';

const root = new URL('..', import.meta.url).pathname;
const made = `${root}out/web/build`;
const bench = `${root}python/tumble/bench/static`;

const shared = {
  alias: { tables: `${made}/tables.json` },
  bundle: true,
  charset: 'utf8',
  logLevel: 'warning',
  target: 'es2022',
  write: false,
};
// The bench serves its mark; the page holds it.
const mark = {
  name: 'mark',
  setup: ({ onResolve }) => onResolve({ filter: /^\/bench\/favicon\.svg$/ }, () => ({ path: `${bench}/favicon.svg` })),
};

const script = await build({ ...shared, entryPoints: [`${root}web/src/page/main.ts`], format: 'esm', minify: true });
const style = await build({
  ...shared,
  stdin: { contents: `@import "${bench}/bench.css"; @import "${root}web/src/page/page.css";`, loader: 'css', resolveDir: root },
  loader: { '.svg': 'dataurl' },
  minify: true,
  plugins: [mark],
});
const core = gzipSync(readFileSync(process.argv[2]), { level: 9 }).toString('base64');
const text = (result) => result.outputFiles[0].text;

const page = `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'">
<meta name="color-scheme" content="light dark">
<title>Tumble</title>
<link rel="icon" href="data:image/svg+xml;base64,${readFileSync(`${bench}/favicon.svg`).toString('base64')}">
<style>${text(style)}</style>
</head>
<body>
<div id="app"></div>
<script type="text/plain" id="core">${core}</script>
<script type="module">${text(script).replaceAll('</script', '<\\/script')}</script>
</body>
</html>
`;
mkdirSync(`${root}out/web`, { recursive: true });
writeFileSync(`${root}out/web/tumble.html`, page);

await build({
  ...shared,
  entryPoints: [`${root}web/src/headless.ts`],
  format: 'esm',
  outfile: `${made}/headless.mjs`,
  platform: 'node',
  write: true,
});
console.log(`out/web/tumble.html: ${(page.length / 1024).toFixed(0)} kB, ${(gzipSync(page).length / 1024).toFixed(0)} kB packed`);
