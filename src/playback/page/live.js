// A page with the sheet in it, to be edited: what is typed is read by the engine and shown at once from
// the pictures that are here. Other lights and another stage are rendered in a worker.

const { show: first, module: packed, ...sheet } = JSON.parse(element("show").textContent);
const text = element("text"), painted = element("colours");

let ask = null, bytes = null, worker = null, wait = 0;
/// The last sheet without errors, what it says, and the number of its lights and stage.
let good = { text: sheet.text, show: first, scene: 0 };
/// The pictures, and the exposure in stops that they are coded at.
let lit = { pictures: first.pictures, size: first.size, made: first.made, exposure: sheet.exposure };
let changing = Promise.resolve();

async function unpacked(code) {
  const file = Uint8Array.from(atob(code), (c) => c.charCodeAt(0));
  const stream = new Blob([file]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/// Shows the last good sheet in the pictures that are here, after what was shown before it.
function showGood() {
  const gain = 2 ** (good.exposure - lit.exposure);
  const pictures = lit.pictures.map((picture) => ({ ...picture, law: picture.law.map((v) => v * gain) }));
  const next = { ...good.show, size: lit.size, made: lit.made, pictures };
  changing = changing.then(() => change(next)).catch(cannotPlay);
}

// ---- the sheet ---------------------------------------------------------------------------------

/// Colours the sheet; what is wrong is underlined.
function colourSheet(tokens, marks) {
  const all = document.createDocumentFragment(), code = text.value;
  let at = 0, m = 0;
  for (const [from, to, kind] of tokens) {
    all.append(code.slice(at, from));
    while (m < marks.length && marks[m][1] <= from) m++;
    const marked = m < marks.length && marks[m][0] < to ? ` ${marks[m][2]}` : "";
    all.append(made("span", { className: `t-${kind}${marked}` }, code.slice(from, to)));
    at = to;
  }
  all.append(code.slice(at), "\n");
  painted.replaceChildren(all);
}

/// What the engine says of the sheet as it stands.
function judge() {
  let answer;
  try {
    answer = ask({ edit: text.value });
  } catch (error) {
    element("judged").textContent = `The engine has stopped: ${error.message}. Save the sheet and load the page again.`;
    return;
  }
  const { failed, said = failed ?? "", is_wrong: isWrong = true, marks = [], tokens = [], show: next, stale, scene, exposure } = answer;
  colourSheet(tokens, marks);
  element("wrong").textContent = said;
  element("wrong").hidden = !said;
  element("wrong").classList.toggle("warned", !isWrong);
  element("judged").textContent = isWrong ? "The last sheet without errors is shown" : "";
  if (!next) return;
  const isSame = scene === good.scene;
  good = { text: text.value, show: next, scene, exposure };
  if (stale) element("judged").textContent = "Other light: rendering";
  else showGood();
  if (isSame) return;
  // What is at work for another scene is of no use any more.
  clearTimeout(wait);
  worker?.terminate();
  if (stale) wait = setTimeout(render, 300);
}

/// Renders the sheet in the worker, coarse and then finer.
function render() {
  const source = `${engineOf}; (${renderHere})()`;
  worker = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
  const id = good.scene;
  worker.onerror = (event) => { element("judged").textContent = `Not rendered: ${event.message}`; };
  worker.onmessage = ({ data }) => {
    if (data.id !== good.scene) return;
    if (data.failed) {
      element("judged").textContent = `Not rendered: ${data.failed}`;
      return;
    }
    ask("taken");
    const { pictures, size, made } = data.show;
    lit = { pictures, size, made, exposure: data.exposure };
    showGood();
    element("judged").textContent = data.is_finest ? "" : `Rendered at step ${data.step}; finer to come`;
  };
  worker.postMessage({ module: bytes, show: sheet, text: good.text, id });
}

/// Puts words in at the caret, as if typed, so that they can be undone.
function put(words) {
  text.focus();
  if (!document.execCommand("insertText", false, words)) text.setRangeText(words, text.selectionStart, text.selectionEnd, "end");
}

let offered = [];
function offer() {
  const at = text.selectionStart;
  const found = at === text.selectionEnd ? ask({ complete: [text.value, at] }) : { words: [] };
  const typed = found.typed ?? "";
  offered = typed ? found.words.filter((word) => word !== typed).slice(0, 8).map((word) => word.slice(typed.length)) : [];
  const one = (rest, i) => {
    const button = made("button", { type: "button", tabIndex: -1 }, `${typed}${rest}${i ? "" : " \u21e5"}`);
    button.addEventListener("mousedown", (event) => { event.preventDefault(); put(rest); });
    return made("li", {}, button);
  };
  element("offers").replaceChildren(...offered.map(one));
}

function onSheetKey(event) {
  if (event.key === "Tab" && offered.length && !event.shiftKey) {
    event.preventDefault();
    put(offered[0]);
  } else if (event.key === "Escape") {
    offered = [];
    element("offers").replaceChildren();
    text.blur();
  } else if (event.key === "Enter" && event.ctrlKey) go();
  event.stopPropagation();
}

/// The sheet as a file, in its canonical layout; as it is where it has errors.
function save() {
  const laid = ask({ format: text.value }).text;
  if (laid !== undefined && laid !== text.value) {
    text.value = laid;
    judge();
  }
  const link = made("a", { href: URL.createObjectURL(new Blob([text.value], { type: "text/plain" })), download: sheet.name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  tell(`${sheet.name} saved`);
}

async function begin() {
  document.body.classList.add("live");
  element("sheet").hidden = false;
  // Where it moves nothing that is being typed.
  element("offers").after(element("wrong"));
  element("sheet-title").textContent = sheet.name;
  text.value = sheet.text;
  await openShow(first);
  bytes = await unpacked(packed);
  ask = await engineOf(bytes);
  const opened = ask({ open: sheet });
  if (opened.failed) throw new Error(opened.failed);
  colourSheet(opened.tokens, opened.marks);
  for (const type of ["keydown", "keyup"]) text.addEventListener(type, type === "keydown" ? onSheetKey : (event) => event.stopPropagation());
  text.addEventListener("input", () => { judge(); offer(); });
  text.addEventListener("scroll", () => { [painted.scrollTop, painted.scrollLeft] = [text.scrollTop, text.scrollLeft]; });
  element("save").addEventListener("click", save);
  text.readOnly = element("save").disabled = false;
  if (asked.has("test")) await test(desk.renderer);
}
begin().catch(cannotPlay);
