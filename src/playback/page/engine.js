// The engine, a WebAssembly module: questions in, answers out. The worker has this text too.

/// A function that answers.
async function engineOf(bytes) {
  const { instance } = await WebAssembly.instantiate(bytes, {});
  const { memory, input, answer, output } = instance.exports;
  return (question) => {
    const asked = new TextEncoder().encode(JSON.stringify(question));
    // The memory is another one where it had to grow.
    const at = input(asked.length);
    new Uint8Array(memory.buffer, at, asked.length).set(asked);
    const length = answer();
    return JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, output(), length)));
  };
}

/// What a worker does: it opens the show, and then renders texts, each at one step after the other.
function renderHere() {
  let ask = null;
  self.onmessage = async ({ data: { module, show, text, id } }) => {
    try {
      if (module) ask = await engineOf(module);
      const opened = ask(show ? { open: { ...show, text } } : { edit: text });
      if (opened.failed) return postMessage({ id, failed: opened.failed });
      for (let step = 1; ; step++) {
        const rendered = ask({ render: step });
        postMessage({ id, step, ...rendered });
        if (rendered.failed || rendered.is_finest) return;
      }
    } catch (error) {
      postMessage({ id, failed: String(error) });
    }
  };
}
