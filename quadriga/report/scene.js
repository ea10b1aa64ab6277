// Draws recorded moments of a team from any side; `moving_scene/scene.py` writes what it reads.
function showScene(figure) {
  const scene = JSON.parse(figure.querySelector('script').textContent);
  const canvas = figure.querySelector('canvas');
  const gl = canvas.getContext('webgl', {antialias: true});
  if (!gl) {
    figure.querySelector('.told').textContent = 'This browser cannot draw in three dimensions.';
    return;
  }
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const shorts = (text) => new Int16Array(bytes(text));
  const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

  // Shapes: each a list of corners and normals, three corners a triangle or two a line.
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, `
      attribute vec3 at, normal;
      uniform mat4 eye;
      uniform vec3 place, size;
      uniform vec4 turn;
      varying vec3 facing;
      vec3 turned(vec3 v) { return v + 2.0 * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
      void main() {
        facing = turned(normal);
        gl_Position = eye * vec4(place + turned(size * at), 1.0);
      }`], [gl.FRAGMENT_SHADER, `
      precision mediump float;
      uniform vec3 colour;
      varying vec3 facing;
      void main() {
        float n = length(facing);
        float light = n < 0.5 ? 1.0
          : 0.55 + 0.45 * max(dot(facing / n, normalize(vec3(0.4, 0.3, 0.9))), 0.0);
        gl_FragColor = vec4(colour * light, 1.0);
      }`]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const [eye, place, size, turn, colour] = ['eye', 'place', 'size', 'turn', 'colour'].map(uniform);
  const [at, normal] = ['at', 'normal'].map((name) => gl.getAttribLocation(program, name));
  gl.enable(gl.DEPTH_TEST);
  gl.enableVertexAttribArray(at);

  function shapeOf(corners, normals, mode) {
    const buffers = [corners, normals].map((values) => {
      if (!values) return null;
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
      return buffer;
    });
    return {buffers, mode, count: corners.length / 3};
  }
  function meshOf(vertices, faces, unit) {
    const corners = [], normals = [];
    for (let k = 0; k < faces.length; k += 3) {
      const [a, b, c] = [0, 1, 2].map((i) => [0, 1, 2].map((j) => unit * vertices[3 * faces[k + i] + j]));
      const [u, v] = [b, c].map((p) => p.map((value, j) => value - a[j]));
      const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const long = Math.hypot(...across) || 1;
      corners.push(...a, ...b, ...c);
      for (let i = 0; i < 3; i++) normals.push(...across.map((value) => value / long));
    }
    return shapeOf(corners, normals, gl.TRIANGLES);
  }
  const CUBE = meshOf(
    [0, 1, 2, 3, 4, 5, 6, 7].flatMap((k) => [k & 1, k >> 1 & 1, k >> 2].map((bit) => bit - 0.5)),
    [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6,
     1, 3, 5, 3, 7, 5], 1);
  const LINE = shapeOf([0, 0, 0, 1, 1, 1], null, gl.LINES);
  const grid = [];  // of short lines: of a long one that begins behind the eye nothing may be drawn
  for (let k = -12; k <= 12; k++) {
    for (let j = -12; j < 12; j++) {
      const [across, from, to] = [k / 2, j / 2, j / 2 + 0.5];
      grid.push(across, from, 0, across, to, 0, from, across, 0, to, across, 0);
    }
  }
  const GRID = shapeOf(grid, null, gl.LINES);
  const meshes = scene.meshes.map((mesh) => ({
    shape: meshOf(shorts(mesh.vertices), new Uint16Array(bytes(mesh.faces)), mesh.unit), ...mesh}));
  const ground = scene.surface && meshOf(
    new Float32Array(bytes(scene.surface.vertices)), new Uint32Array(bytes(scene.surface.faces)), 1);
  const boxes = new Float32Array(bytes(scene.boxes));
  const boxColours = new Uint8Array(bytes(scene.boxColours));
  const spans = scene.spans.map((span) => ({...span,
    positions: shorts(span.positions), quats: shorts(span.quats), feet: shorts(span.feet),
    anchors: shorts(span.anchors), forces: shorts(span.forces),
    contact: new Uint8Array(bytes(span.contact))}));

  function draw(shape, paint, where, attitude = [1, 0, 0, 0], scale = [1, 1, 1]) {
    shape.buffers.forEach((buffer, k) => {
      const attribute = [at, normal][k];
      if (buffer) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 0, 0);
        gl.enableVertexAttribArray(attribute);
      } else {
        gl.disableVertexAttribArray(attribute);
        gl.vertexAttrib3f(attribute, 0, 0, 0);
      }
    });
    gl.uniform3fv(colour, paint);
    gl.uniform3fv(place, where);
    gl.uniform4fv(turn, attitude);
    gl.uniform3fv(size, scale);
    gl.drawArrays(shape.mode, 0, shape.count);
  }
  const line = (from, to, paint) => draw(LINE, paint, from, undefined, to.map((v, k) => v - from[k]));

  const state = {span: 0, picture: 0, playing: false, rate: 1, yaw: 0.9, pitch: 0.35,
                 away: 0.9 + 0.5 * scene.robots.length};
  const n = scene.robots.length;
  const take = (values, from, unit) => [0, 1, 2].map((k) => unit * values[from + k]);

  function look(span, centre) {
    const {yaw, pitch, away} = state;
    const back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    const up = [-Math.sin(pitch) * Math.cos(yaw), -Math.sin(pitch) * Math.sin(yaw), Math.cos(pitch)];
    const camera = centre.map((value, k) => value + away * back[k]);
    const f = 2.2, aspect = canvas.width / canvas.height, near = 0.05, far = 60;
    const dot = (a) => -(a[0] * camera[0] + a[1] * camera[1] + a[2] * camera[2]);
    const deep = (far + near) / (near - far), shift = 2 * far * near / (near - far);
    const rows = [right.map((v) => v * f / aspect), up.map((v) => v * f), back.map((v) => v * deep),
                  back.map((v) => -v)];
    const ends = [dot(right) * f / aspect, dot(up) * f, dot(back) * deep + shift, -dot(back)];
    gl.uniformMatrix4fv(eye, false, [0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(ends));
  }

  function paint() {
    const span = spans[state.span], p = Math.min(Math.floor(state.picture), span.pictures - 1);
    const dark = matchMedia('(prefers-color-scheme: dark)').matches;
    canvas.width = canvas.clientWidth * devicePixelRatio;
    canvas.height = canvas.clientHeight * devicePixelRatio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...(dark ? [0.1, 0.11, 0.13] : [0.95, 0.95, 0.94]), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const trunks = scene.robots.map((_, i) => take(span.positions, 3 * (p * n + i) * span.links, span.unit));
    const centre = [0, 1, 2].map((k) => trunks.reduce((sum, trunk) => sum + trunk[k], 0) / n);
    look(span, [centre[0], centre[1], 0.2]);
    // Its lines are at multiples of half a metre of the world, below all that lies on the ground.
    const middle = [0, 1].map((k) => Math.round(2 * (centre[k] + span.origin[k])) / 2 - span.origin[k]);
    draw(GRID, dark ? [0.3, 0.32, 0.35] : [0.8, 0.8, 0.8], [...middle, -0.003]);
    const offset = span.origin.map((value) => -value);
    if (ground) draw(ground, [0.66, 0.6, 0.47], offset);
    for (let k = 0; k < boxes.length; k += 10) {
      const box = boxes.slice(k, k + 10), c = 3 * k / 10;
      draw(CUBE, [0, 1, 2].map((j) => boxColours[c + j] / 255),
           [0, 1, 2].map((j) => box[j] + offset[j]), box.slice(3, 7), box.slice(7, 10));
    }
    scene.robots.forEach((robot, i) => {
      const own = rgb(robot.colour), first = (p * n + i) * span.links;
      const quat = (link) => [0, 1, 2, 3].map((k) => span.quats[4 * (first + link) + k] / 32767);
      for (const mesh of meshes) {
        for (const link of mesh.links) {
          draw(mesh.shape, mesh.colour ? rgb(mesh.colour) : own,
               take(span.positions, 3 * (first + link), span.unit), quat(link));
        }
      }
      const carried = scene.loads.carriers.indexOf(i);
      if (carried >= 0) {
        const [w, x, y, z] = quat(0), [a, b, c] = scene.loads.places[carried];
        const t = [y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c];
        const moved = [a + 2 * (y * t[2] - z * t[1]), b + 2 * (z * t[0] - x * t[2]), c + 2 * (x * t[1] - y * t[0])];
        draw(CUBE, [0.55, 0.36, 0.2], trunks[i].map((v, k) => v + moved[k]), [w, x, y, z], [0.2, 0.15, 0.04]);
      }
      for (let leg = 0; leg < 4; leg++) {
        const from = 3 * ((p * n + i) * 4 + leg), foot = take(span.feet, from, span.unit);
        const on = span.contact[(p * n + i) * 4 + leg];
        draw(CUBE, on ? own : [0.1, 0.1, 0.1], foot, undefined, [0.035, 0.035, 0.035]);
        const force = take(span.forces, from, 0.1 * 0.003);
        if (Math.hypot(...force) > 0.006) line(foot, foot.map((v, k) => v + force[k]), own);
      }
    });
    for (const [a, b] of scene.yokes) {
      const [from, to] = [a, b].map((i) => take(span.anchors, 3 * (p * n + i), span.unit));
      line(from, to, [0.85, 0.65, 0.13]);
    }
    const known = span.isTruth ? '' : ', where robots believe to be';
    figure.querySelector('.told').textContent =
      `${((span.first + p * span.step) / 1000).toFixed(2)} s${known}`;
    figure.querySelector('input').value = p;
  }

  for (const robot of scene.robots) {
    const name = document.createElement('b');
    [name.textContent, name.style.color] = [robot.name, robot.colour];
    figure.querySelector('.told').before(name);
  }
  const [button, slower] = figure.querySelectorAll('button');
  const slider = figure.querySelector('input'), choice = figure.querySelector('select');
  spans.forEach((span, k) => choice.add(new Option(span.title, k)));
  choice.hidden = spans.length < 2;
  let before = 0;
  function tick(now) {
    if (!state.playing) return;
    const span = spans[state.span];
    state.picture = (state.picture + (now - before) * state.rate / span.step) % span.pictures;
    before = now;
    paint();
    requestAnimationFrame(tick);
  }
  function play(playing) {
    state.playing = playing;
    button.textContent = playing ? 'Pause' : 'Play';
    before = performance.now();
    if (playing) requestAnimationFrame(tick);
  }
  function choose(k) {
    Object.assign(state, {span: k, picture: 0});
    slider.max = spans[k].pictures - 1;
    paint();
  }
  button.onclick = () => play(!state.playing);
  slower.onclick = () => {
    state.rate = state.rate === 1 ? 0.2 : 1;
    slower.textContent = state.rate === 1 ? 'Slowly' : 'As it was';
  };
  slider.oninput = () => { play(false); state.picture = Number(slider.value); paint(); };
  choice.onchange = () => choose(Number(choice.value));
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  canvas.onpointermove = (event) => {
    if (!event.buttons) return;
    state.yaw -= event.movementX * 0.008;
    state.pitch = Math.min(1.5, Math.max(0.02, state.pitch + event.movementY * 0.008));
    paint();
  };
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    state.away = Math.min(20, Math.max(0.5, state.away * Math.exp(event.deltaY * 0.001)));
    paint();
  }, {passive: false});
  addEventListener('resize', paint);
  choose(0);
}
document.querySelectorAll('figure.scene').forEach(showScene);
