// A page by itself: the show is inside.

async function start() {
  await openShow(JSON.parse(element("show").textContent));
  if (asked.has("test")) await test(desk.renderer);
}
start().catch(cannotPlay);
