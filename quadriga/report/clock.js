// One world time in every figure: that under the mouse, else the one clicked or linked to.
const clock = document.getElementById('clock');
const figures = [...document.querySelectorAll('svg.time')].map(svg => ({
  svg, panels: svg.dataset.panels.split(',').map(panel => panel.split(' ').map(Number))}));
let chosen = null;
function show(t) {
  clock.style.display = t === null ? 'none' : 'block';
  clock.textContent = t === null ? '' : t.toFixed(3) + ' s';
  for (const {svg, panels} of figures) {
    svg.querySelectorAll('.now').forEach(line => line.remove());
    for (const [x, width, y, height, begin, end] of panels) {
      if (t === null || t < begin || t > end) continue;
      const line = document.createElementNS('http://www.w3.org/2000/svg', 'path');
      line.setAttribute('class', 'now');
      line.setAttribute('d', `M${x + width * (t - begin) / (end - begin)} ${y}v${height}`);
      svg.append(line);
    }
  }
}
for (const {svg, panels} of figures) {
  const timeAt = event => {
    const box = svg.getBoundingClientRect();
    const at = (event.clientX - box.left) * svg.viewBox.baseVal.width / box.width;
    const panel = panels.find(([x, width]) => at >= x && at <= x + width);
    return panel ? panel[4] + (at - panel[0]) / panel[1] * (panel[5] - panel[4]) : null;
  };
  svg.addEventListener('mousemove', event => show(timeAt(event) ?? chosen));
  svg.addEventListener('mouseleave', () => show(chosen));
  svg.addEventListener('click', event => { chosen = timeAt(event); show(chosen); });
}
function go() {
  const linked = /^#t=([0-9.]+)/.exec(location.hash);
  if (!linked) return;
  show(chosen = Number(linked[1]));
  document.querySelector('#timeline svg')?.scrollIntoView({block: 'start'});
}
addEventListener('hashchange', go);
document.addEventListener('click', event => {
  const link = event.target.closest('a[href^="#t="]');
  if (link && link.hash === location.hash) go();
});
go();
