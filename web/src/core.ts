/** The core, as WebAssembly: samples and a request in, an answer out (crates/tumble-web). */

interface Exports {
  memory: WebAssembly.Memory;
  numbers(count: number): number;
  text(bytes: number): number;
  run(): number;
  answer(): number;
}

/** Answers requests; arrays are laid down one after the other. */
export class Core {
  private constructor(private readonly exports: Exports) {}

  static async of(module: BufferSource): Promise<Core> {
    const { instance } = await WebAssembly.instantiate(module);
    return new Core(instance.exports as unknown as Exports);
  }

  ask<Answer>(request: { ask: string } & Record<string, unknown>, arrays: readonly Float64Array[] = []): Answer {
    const { exports } = this;
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    let place = exports.numbers(arrays.reduce((sum, each) => sum + each.length, 0));
    const words = exports.text(bytes.length);
    for (const each of arrays) {
      new Float64Array(exports.memory.buffer, place, each.length).set(each);
      place += each.byteLength;
    }
    new Uint8Array(exports.memory.buffer, words, bytes.length).set(bytes);
    const length = exports.run();
    const answer = new TextDecoder().decode(new Uint8Array(exports.memory.buffer, exports.answer(), length));
    const found = JSON.parse(answer) as Answer & { bug?: string };
    if (found !== null && typeof found === 'object' && 'bug' in found) throw new Error(found.bug);
    return found;
  }
}
