// The engine: an instance of the page's WebAssembly, and calls of it with texts and numbers. It runs in a worker of the page,
// and in Node for the tests.

/** Makes an instance of a module; modules that it assembles join its table of functions. */
function makeEngine(module) {
  let exports = null;
  const encoder = new TextEncoder(), decoder = new TextDecoder();
  const bytes = (at, n) => new Uint8Array(exports.memory.buffer, at, n);
  const assemble = (at, n, name, m) => {
    try {
      const assembled = new WebAssembly.Module(bytes(at, n).slice());
      const made = new WebAssembly.Instance(assembled, { host: { memory: exports.memory } });
      const place = exports.__indirect_function_table.grow(1);
      exports.__indirect_function_table.set(place, made.exports[decoder.decode(bytes(name, m))]);
      return place;
    } catch {
      // The interpreter goes on.
      return 0;
    }
  };
  exports = new WebAssembly.Instance(module, { host: { assemble } }).exports;
  const put = (...parts) => {
    const all = parts.map((part) => (typeof part === "string" ? encoder.encode(part) : new Uint8Array(part)));
    let at = exports.room(all.reduce((sum, part) => sum + part.length, 0));
    for (const part of all) {
      bytes(at, part.length).set(part);
      at += part.length;
    }
    return all.map((part) => part.length);
  };
  const text = () => decoder.decode(bytes(exports.text(), exports.text_length()));
  const look = (forces) => {
    const at = exports.look(forces ? 1 : 0);
    return at ? new Float64Array(exports.memory.buffer, at, exports.look_length()).slice() : new Float64Array(0);
  };
  return {
    exports,
    text,
    look,
    /** Opens a file among some, `[name, contents]` each; says whether there is a scene, and describes it or the trouble. */
    open(name, files, { floating = false, floor = null } = {}) {
      for (const [name, contents] of files) {
        const [length] = put(name, contents);
        exports.file(length);
      }
      put(name);
      const ok = exports.open(floating ? 1 : 0, floor === null ? 0 : 1, floor ?? 0) === 1;
      return { ok, text: text() };
    },
    /** Takes steps, for at most so many milliseconds. */
    advance(steps, most = Infinity) {
      const begin = performance.now();
      let done = 0;
      while (done < steps && performance.now() - begin < most) {
        const some = Math.min(most === Infinity ? steps : 4, steps - done), got = exports.advance(some);
        done += got;
        if (got < some) return { done, trouble: text() };
      }
      return { done, trouble: "" };
    },
    setState(t, values) {
      put(new Float64Array(values).buffer);
      exports.set_state(t);
    },
    settings({ step, contacts, method }) {
      put(method);
      exports.settings(step, contacts);
    },
    source() {
      exports.source();
      return text();
    },
    describe() {
      exports.describe();
      return text();
    },
    /** Triangles: of a ball, of the parts, of the shapes; a list of arrays. */
    meshes() {
      const at = exports.meshes(), all = new Float32Array(exports.memory.buffer, at, exports.meshes_length()), out = [];
      for (let k = 0; k < all.length; k += 1 + 6 * all[k]) out.push(all.slice(k + 1, k + 1 + 6 * all[k]));
      return out;
    },
  };
}
