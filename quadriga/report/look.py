"""How the page looks, light and dark, and the little script that shows one time in every figure."""

from __future__ import annotations

from typing import Final

# Okabe and Ito's colours, which the colour-blind can tell apart, brightened where it is dark;
# robots beyond the fifth are dashed as well.
_LIGHT: Final = """
--paper:#fff;--ink:#1b1b1b;--soft:#666;--line:#d4d4d4;--grid:#ececec;--wash:#f5f5f3;
--blue:#0072b2;--orange:#d55e00;--green:#009e73;--purple:#b0508c;--yellow:#b8860b;
--sky:#56b4e9;--bad:#b3261e;--badwash:#fdecea;--stance:#cfe3f1;
"""
_DARK: Final = """
--paper:#15181c;--ink:#e6e6e6;--soft:#9aa0a6;--line:#3c4046;--grid:#262a2f;--wash:#1d2126;
--blue:#56b4e9;--orange:#f08c3c;--green:#2ec49a;--purple:#e08fc0;--yellow:#e6c229;
--sky:#7cc7f2;--bad:#ff8a80;--badwash:#3a2220;--stance:#2a4257;
"""
_ROBOTS: Final = ("blue", "orange", "green", "purple", "yellow")
# Styles of bars, and the colour of each.
BARS: Final = {
    "mode-stand": "--line", "mode-walk": "--stance", "mode-stopping": "--yellow",
    "mode-damping": "--bad", "mode-estop": "--bad", "mode-plan": "--stance",
    "mode-other": "--soft",
    "stance": "--stance", "contact": "--blue", "faded": "--yellow", "nominal": "--orange",
    "gap": "--bad", "count": "--soft", "event": "--ink", "trouble": "--bad",
}  # fmt: skip

_RULES: Final = """
*{box-sizing:border-box}
body{margin:0 auto;max-width:1080px;padding:1rem 1.2rem 4rem;background:var(--paper);
color:var(--ink);font:15px/1.45 system-ui,sans-serif}
h1{font-size:1.5rem;margin:.4rem 0 .1rem}h2{font-size:1.15rem;margin:2.2rem 0 .4rem;
border-bottom:1px solid var(--line);padding-bottom:.2rem}h3{font-size:1rem;margin:1.2rem 0 .2rem}
p{margin:.3rem 0 .6rem}a{color:var(--blue)}.soft,figcaption{color:var(--soft)}
.verdict{font-size:1.05rem;font-weight:600;margin:.2rem 0 .8rem}.good{color:var(--green)}
.bad{color:var(--bad)}td.bad{background:var(--badwash);font-weight:600}
nav{display:flex;flex-wrap:wrap;gap:.1rem .9rem;font-size:.9rem;margin:.6rem 0}
.note{background:var(--wash);border-left:4px solid var(--yellow);padding:.5rem .8rem;margin:.8rem 0}
.note p{margin:.15rem 0}
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.88rem;margin:.4rem 0}
th,td{text-align:left;padding:.22rem .7rem .22rem 0;border-bottom:1px solid var(--grid);
vertical-align:top}td.bad{padding-left:.35rem}th{font-weight:600;color:var(--soft)}
td.name{font-weight:600;white-space:nowrap}td.pre{white-space:pre-line}
.number td+td,.number th+th{text-align:right;font-variant-numeric:tabular-nums}
figure{margin:.5rem 0 1rem}svg{width:100%;height:auto;display:block}svg svg{overflow:hidden}
summary{cursor:pointer;font-weight:600;margin:.5rem 0}
text{fill:var(--soft);font:12px system-ui,sans-serif}text.title{fill:var(--ink);font-weight:600}
g text{font-size:110px}.end{text-anchor:end}.mid{text-anchor:middle}
.axis{stroke:var(--soft);fill:none}.grid{stroke:var(--grid);fill:none}
.level{stroke:var(--soft);stroke-dasharray:2 3}
path{vector-effect:non-scaling-stroke}
.curve{fill:none;stroke-width:1.3;stroke-linejoin:round}.curve.dots{stroke-linecap:round;stroke-width:4}
.key{display:inline-flex;align-items:center;gap:.35rem;margin-right:1.1rem;font-size:.88rem}
.key svg{width:26px;height:12px;flex:none}
.true{stroke:var(--blue);stroke-width:2.4;opacity:.55}.own{stroke:var(--green);stroke-width:1}.planned{stroke:var(--orange)}
.asked{stroke:var(--ink);stroke-dasharray:5 3;stroke-width:1}
.yoke{stroke:var(--yellow);stroke-width:1.5}
path.fall,.key .fall{stroke:var(--bad);stroke-width:1.6;stroke-dasharray:6 2}
text.fall{fill:var(--bad);font-weight:600}path.stopped{stroke:var(--yellow);stroke-width:1.4}
.bar{stroke:none}.now{stroke:var(--purple);stroke-width:1.5;pointer-events:none}
#clock{position:fixed;right:1rem;bottom:1rem;background:var(--ink);color:var(--paper);
padding:.2rem .6rem;border-radius:4px;font-variant-numeric:tabular-nums;display:none}
@media print{details{display:block}#clock,nav{display:none}}
"""

SCRIPT: Final = """
const figures=[...document.querySelectorAll('svg.time')].map(svg=>({svg,
t:svg.dataset.t.split(' ').map(Number),
p:svg.dataset.p.split(',').map(q=>q.split(' ').map(Number))}));
const clock=document.getElementById('clock');
function show(t){for(const f of figures){f.svg.querySelectorAll('.now').forEach(e=>e.remove());
if(t===null||t<f.t[0]||t>f.t[1])continue;
for(const[x,w,y,h]of f.p){const e=document.createElementNS('http://www.w3.org/2000/svg','path');
e.setAttribute('class','now');
e.setAttribute('d',`M${x+w*(t-f.t[0])/(f.t[1]-f.t[0])} ${y}v${h}`);f.svg.append(e)}}
clock.style.display=t===null?'none':'block';clock.textContent=t===null?'':t.toFixed(3)+' s'}
let kept=null;
for(const f of figures){const at=e=>{const r=f.svg.getBoundingClientRect();
const x=(e.clientX-r.left)*f.svg.viewBox.baseVal.width/r.width;
const p=f.p.find(([a,w])=>x>=a&&x<=a+w);
return p?f.t[0]+(x-p[0])/p[1]*(f.t[1]-f.t[0]):null};
f.svg.addEventListener('mousemove',e=>show(at(e)??kept));
f.svg.addEventListener('mouseleave',()=>show(kept));
f.svg.addEventListener('click',e=>{kept=at(e);show(kept)})}
function go(){const m=/^#t=([0-9.]+)/.exec(location.hash);if(!m)return;kept=Number(m[1]);show(kept);
const a=document.querySelector('svg.time[data-main]');if(a)a.scrollIntoView({block:'start'})}
addEventListener('hashchange',go);
document.addEventListener('click',e=>{const a=e.target.closest('a[href^="#t="]');
if(a&&a.hash===location.hash)go()});go();
"""


def style_sheet() -> str:
    """All rules of the page."""
    rules = [
        f":root{{color-scheme:light dark;{_LIGHT}}}",
        f"@media(prefers-color-scheme:dark){{:root{{{_DARK}}}}}",
        _RULES,
    ]
    for k in range(10):
        colour = f"var(--{_ROBOTS[k % len(_ROBOTS)]})"
        dashes = ";stroke-dasharray:4 2" if k >= len(_ROBOTS) else ""
        rules.append(f"path.r{k}{{stroke:{colour}{dashes}}}circle.r{k}{{fill:{colour}}}")
    rules += [f".bar.{name}{{fill:var({colour})}}" for name, colour in BARS.items()]
    rules += [f"rect.{name}{{fill:var({colour})}}" for name, colour in BARS.items()]
    return "".join(rules).replace("\n", "")
