// The worker: it owns the engine and answers the page, one request after the other. Every file gets a fresh instance, so that
// nothing is left of the one before.

let module = null, engine = null;

const actions = {
  async start({ text, module: given }) {
    module = given ?? (await WebAssembly.compile(unlzma(letters(text))));
    return { module };
  },
  open({ name, files, options, settings, forces }) {
    engine = makeEngine(module);
    const { ok, text } = engine.open(name, files, options);
    if (ok) engine.settings(settings);
    return { ok, text, numbers: ok ? engine.look(forces) : null, meshes: ok ? engine.meshes() : [] };
  },
  /** Steps, with the hand that holds a body moved before; what is seen after every `each` of them, however rarely is drawn. */
  frame({ steps, most, each = steps, forces, hand }) {
    const begin = performance.now(), seen = [];
    let spent = 0;
    if (hand) engine.exports.pull_to(...hand);
    for (let done = 0; ; ) {
      const some = Math.min(each, steps - done), from = performance.now(), got = engine.advance(some, most - (from - begin));
      spent += performance.now() - from;
      done += got.done;
      seen.push(engine.look(forces));
      if (done === steps || got.done < some) return { numbers: seen.pop(), seen, done, trouble: got.trouble, spent };
    }
  },
  /** Goes to a state that is shown already. */
  state({ t, values }) {
    engine.setState(t, values);
    return {};
  },
  section({ args }) {
    engine.exports.section(...args);
    return {};
  },
  /** A call that changes something; `ok` is false where it was refused, with a text. */
  change({ call, args, forces }) {
    const ok = engine.exports[call](...args) !== 0;
    return { ok, text: ok ? "" : engine.text(), numbers: engine.look(forces) };
  },
  settings({ settings, forces }) {
    engine.settings(settings);
    return { numbers: engine.look(forces) };
  },
  describe() {
    return { text: engine.describe(), meshes: engine.meshes() };
  },
  source() {
    return { text: engine.source() };
  },
};

onmessage = async ({ data }) => {
  try {
    const answer = await actions[data.action](data);
    postMessage({ id: data.id, answer }, [...(answer.seen ?? []), ...(answer.numbers ? [answer.numbers] : [])].map((numbers) => numbers.buffer));
  } catch (error) {
    // The state of a machine that has stopped is not known: the page starts another.
    postMessage({ id: data.id, error: String(error?.message ?? error) });
  }
};
