"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id);
  const frames = data.frames.length;

  // ---- Numbers, packed by the program: 16-bit steps within the bounds, 32-bit floats for poses and positions.
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  for (const body of data.bodies) {
    body.steps = new Int16Array(bytes(body.steps));
    body.poses = new Float32Array(bytes(body.poses));
  }
  for (const joint of data.joints) joint.positions = new Float32Array(bytes(joint.positions));

  // ---- Time: a slider, a button, and a line in every chart that shows time.
  const slider = byId("time"), play = byId("play"), clock = byId("clock");
  slider.max = frames - 1;
  let frame = 0, running = false, draw = () => {};
  const moments = [...document.querySelectorAll(".moment")].map((path) => {
    const { from, to, left, right } = path.dataset;
    path.closest("svg.chart")?.classList.add("timed");
    return { path, from: +from, to: +to, left: +left, right: +right };
  });
  const show = (next) => {
    frame = Math.max(0, Math.min(frames - 1, next));
    slider.value = frame;
    const time = data.times[Math.round(frame)];
    clock.textContent = data.seconds ? `${time.toFixed(2)} s` : `frame ${data.frames[Math.round(frame)]}`;
    for (const { path, from, to, left, right } of moments) {
      path.setAttribute("transform", `translate(${(right - left) * (time - from) / (to - from || 1)} 0)`);
    }
    draw();
  };
  const nearest = (time) => {
    let low = 0, high = frames - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (data.times[middle] < time) low = middle + 1; else high = middle;
    }
    return low;
  };
  slider.addEventListener("input", () => { stop(); show(+slider.value); });
  document.addEventListener("pointerdown", (event) => {
    const chart = event.target.closest?.("svg.timed");
    const moment = chart && moments.find(({ path }) => chart.contains(path));
    if (!moment) return;
    const seek = (e) => {
      const box = chart.getBoundingClientRect();
      const x = (e.clientX - box.left) / box.width * chart.viewBox.baseVal.width;
      const share = (x - moment.left) / (moment.right - moment.left);
      if (share < -0.03 || share > 1.03) return;
      stop();
      show(nearest(moment.from + share * (moment.to - moment.from)));
    };
    seek(event);
    const end = () => { removeEventListener("pointermove", seek); removeEventListener("pointerup", end); };
    addEventListener("pointermove", seek);
    addEventListener("pointerup", end);
  });
  // The whole recording plays in its own time, within reason.
  const length = data.seconds ? data.times[frames - 1] - data.times[0] : frames / 30;
  const speed = Math.max(1, length / 30) * Math.min(1, Math.max(length, 1e-9) / 4);
  let last = 0;
  const run = (now) => {
    if (!running) return;
    const passed = Math.min(0.1, (now - last) / 1000) * speed;
    last = now;
    let next;
    if (data.seconds) {
      const time = data.times[0] + playing + passed;
      playing += passed;
      next = nearest(time);
      if (time >= data.times[frames - 1]) { playing = 0; next = 0; }
    } else {
      playing = (playing + passed * 30) % frames;
      next = Math.floor(playing);
    }
    show(next);
    requestAnimationFrame(run);
  };
  let playing = 0;
  const stop = () => {
    running = false;
    byId("play-sign").setAttribute("d", "M3 1.5v13l11-6.5z");
    play.setAttribute("aria-label", "play");
  };
  play.addEventListener("click", () => {
    if (running) return stop();
    running = true;
    playing = data.seconds ? data.times[Math.round(frame)] - data.times[0] : frame;
    if (frame >= frames - 1) playing = 0;
    byId("play-sign").setAttribute("d", "M2 1h4v14H2zM10 1h4v14h-4z");
    play.setAttribute("aria-label", "pause");
    last = performance.now();
    requestAnimationFrame(run);
  });

  // ---- A link to a folded pair opens it.
  const open = () => {
    const target = location.hash && byId(location.hash.slice(1));
    if (target?.tagName === "DETAILS") target.open = true;
  };
  addEventListener("hashchange", open);
  open();

  // ---- The recording in space.
  const { Vector3, Matrix4, Quaternion, Color } = THREE;
  const stage = byId("stage");
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  } catch {
    // No WebGL: the drawn picture stays, and charts still follow the slider.
    document.documentElement.dataset.stage = "picture";
    show(0);
    return;
  }
  byId("fallback").remove();
  byId("view").hidden = false;
  byId("hint").hidden = false;
  stage.prepend(renderer.domElement);
  renderer.setPixelRatio(Math.min(2, devicePixelRatio));
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(38, 1, data.size * 1e-3, data.size * 60);
  scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b6c2, 3.4));
  const lamp = new THREE.DirectionalLight(0xffffff, 1.4);
  scene.add(camera, lamp);
  camera.add(lamp);
  lamp.position.set(0.4, 0.8, 0.3);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  controls.enableDamping = false;
  controls.addEventListener("change", () => paint());

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axisColour = () => new Color(style("--axis"));

  // `world_from_body` of a frame; where a body is not posed, as it was last.
  const poseOf = (body, at, matrix) => {
    const { poses } = data.bodies[body];
    for (let f = at; f >= 0; f -= 1) {
      if (!Number.isNaN(poses[7 * f])) {
        const [x, y, z, qx, qy, qz, qw] = poses.subarray(7 * f, 7 * f + 7);
        return matrix.compose(new Vector3(x, y, z), new Quaternion(qx, qy, qz, qw), new Vector3(1, 1, 1));
      }
    }
    return matrix.identity();
  };
  const posed = (body) => data.bodies[body].poses.some((x) => !Number.isNaN(x));
  let viewer = posed(data.base) ? data.base : -1;
  const viewAt = (at, matrix) => viewer < 0 ? matrix.identity() : poseOf(viewer, at, matrix).invert();
  const sighted = (at) => viewer < 0 || !Number.isNaN(data.bodies[viewer].poses[7 * at]);
  const place = (body, at, feature, point) => {
    const index = 3 * (at * body.count + feature);
    const { steps, origin, step } = body;
    if (steps[index] === -32768) return false;
    point.set(origin[0] + step * steps[index], origin[1] + step * steps[index + 1], origin[2] + step * steps[index + 2]);
    return true;
  };

  // Bodies: a ball for every feature, rods between neighbours, the paths of a few.
  const point = new Vector3(), matrix = new Matrix4(), view = new Matrix4();
  const hidden = new Set();
  const label = (name, colour) => {
    // Long names would hide what they are names of.
    const text = name.length > 30 ? `${name.slice(0, 16)}…${name.slice(-12)}` : name;
    const canvas = document.createElement("canvas");
    const pen = canvas.getContext("2d");
    const font = "600 34px system-ui, 'Segoe UI', Arial, sans-serif";
    pen.font = font;
    canvas.width = Math.ceil(pen.measureText(text).width) + 28;
    canvas.height = 52;
    pen.font = font;
    pen.lineJoin = "round";
    pen.lineWidth = 9;
    pen.strokeStyle = dark.matches ? "rgba(20,25,31,.85)" : "rgba(255,255,255,.9)";
    pen.strokeText(text, 14, 38);
    pen.fillStyle = colour;
    pen.fillText(text, 14, 38);
    const map = new THREE.CanvasTexture(canvas);
    map.colorSpace = "srgb";
    const material = new THREE.SpriteMaterial({ map, depthTest: false, sizeAttenuation: false });
    const sprite = new THREE.Sprite(material);
    sprite.userData.wide = canvas.width / canvas.height;
    sprite.center.set(0, 0.5);
    sprite.renderOrder = 10;
    scene.add(sprite);
    return sprite;
  };
  const ball = new THREE.SphereGeometry(1, 14, 10);
  for (const body of data.bodies) {
    const colour = new Color(body.colour);
    body.balls = new THREE.InstancedMesh(ball, new THREE.MeshStandardMaterial({ color: colour, roughness: 0.55 }), Math.max(1, body.count));
    body.balls.frustumCulled = false;
    body.balls.count = body.count;
    body.rods = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.55 }));
    body.rods.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * body.edges.length), 3).setUsage(THREE.DynamicDrawUsage));
    body.rods.frustumCulled = false;
    body.trails = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.3, depthWrite: false }));
    body.trails.frustumCulled = false;
    body.label = label(body.name, body.colour);
    scene.add(body.balls, body.rods, body.trails);
  }
  const trails = () => {
    // A jump that no other step comes near is no path.
    for (const body of data.bodies) {
      const lines = [];
      const before = new Vector3();
      const chosen = body.trail;
      for (const feature of chosen) {
        let seen = -9;
        for (let at = 0; at < frames; at += 1) {
          if (!sighted(at) || !place(body, at, feature, point)) continue;
          point.applyMatrix4(viewAt(at, view));
          if (at - seen <= 2 && point.distanceTo(before) < 0.2 * data.size) lines.push(before.x, before.y, before.z, point.x, point.y, point.z);
          before.copy(point);
          seen = at;
        }
      }
      body.trails.geometry.dispose();
      body.trails.geometry = new THREE.BufferGeometry();
      body.trails.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines), 3));
    }
  };

  // Joints: an axis within its cone, and how far it has moved.
  const basis = (direction, start) => {
    const z = direction.clone().normalize();
    const x = start.clone().addScaledVector(z, -start.dot(z));
    if (x.lengthSq() < 1e-12) x.set(Math.abs(z.x) < 0.7 ? 1 : 0, Math.abs(z.x) < 0.7 ? 0 : 1, 0).addScaledVector(z, -(Math.abs(z.x) < 0.7 ? z.x : z.y));
    x.normalize();
    return new Matrix4().makeBasis(x, new Vector3().crossVectors(z, x), z);
  };
  const upright = (mesh) => { mesh.rotation.x = Math.PI / 2; return mesh; };
  const flat = (opacity) => new THREE.MeshBasicMaterial({ color: axisColour(), transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false });
  const solid = () => new THREE.MeshStandardMaterial({ color: axisColour(), roughness: 0.45 });
  const sector = (inner, outer, from, to) => {
    const parts = Math.max(8, Math.ceil(Math.abs(to - from) * 20));
    const corners = [], faces = [];
    for (let k = 0; k <= parts; k += 1) {
      const angle = from + (to - from) * k / parts;
      for (const radius of [inner, outer]) corners.push(radius * Math.cos(angle), radius * Math.sin(angle), 0);
      if (k < parts) faces.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 1, 2 * k + 3, 2 * k + 2);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(corners), 3));
    geometry.setIndex(faces);
    return geometry;
  };
  const tau = 2 * Math.PI;
  for (const joint of data.joints) {
    const group = new THREE.Group(), inner = new THREE.Group();
    group.matrixAutoUpdate = false;
    group.add(inner);
    const { half, radius } = joint, thin = 0.012 * half + 0.004 * radius;
    inner.matrixAutoUpdate = false;
    const direction = new Vector3(...(joint.direction ?? [0, 0, 1]));
    inner.matrix.copy(basis(direction, new Vector3(...joint.start))).setPosition(...joint.point);
    const tip = (z, down) => {
      const cone = upright(new THREE.Mesh(new THREE.ConeGeometry(3.2 * thin, 9 * thin, 20), solid()));
      if (down) cone.rotation.x = -Math.PI / 2;
      cone.position.z = z;
      return cone;
    };
    if (joint.direction) {
      inner.add(upright(new THREE.Mesh(new THREE.CylinderGeometry(thin, thin, 2 * half, 16), solid())));
      if (joint.angle > 0) {
        // Where little is known, a cone as wide as that would hide the rest.
        const most = Math.min(0.45 * half, 0.2 * data.size);
        const known = half * Math.tan(Math.min(2 * joint.angle, 1.5)) + 2 * (joint.distance ?? 0);
        const wide = Math.min(known, most), narrow = Math.min(Math.max(2 * (joint.distance ?? 0), 1e-6), most);
        const opacity = known > most ? 0.07 : 0.16;
        for (const sign of [1, -1]) {
          const cone = new THREE.Mesh(new THREE.CylinderGeometry(sign > 0 ? wide : narrow, sign > 0 ? narrow : wide, half, 40, 1, true), flat(opacity));
          upright(cone).position.z = sign * half / 2;
          inner.add(cone);
        }
      }
    } else {
      inner.add(new THREE.Mesh(new THREE.SphereGeometry(4 * thin, 24, 16), solid()));
      const known = 2 * (joint.distance ?? 0), most = 0.2 * data.size;
      if (known > 4 * thin) {
        inner.add(new THREE.Mesh(new THREE.SphereGeometry(Math.min(known, most), 24, 16), flat(known > most ? 0.07 : 0.16)));
      }
    }
    const turning = ["revolute", "screw", "cylindrical", "planar"].includes(joint.kind);
    if (turning) {
      const [least, most] = joint.range[0] ?? [0, 0];
      const whole = most - least >= tau;
      inner.add(new THREE.Mesh(sector(0.86 * radius, radius, whole ? 0 : least, whole ? tau : most), flat(0.5)));
      joint.done = new THREE.Mesh(new THREE.BufferGeometry(), flat(0.22));
      joint.needle = new THREE.Group();
      const hand = new THREE.Mesh(new THREE.CylinderGeometry(0.7 * thin, 0.7 * thin, radius, 10), solid());
      hand.rotation.z = Math.PI / 2;
      hand.position.x = radius / 2;
      joint.needle.add(hand);
      inner.add(joint.done, joint.needle);
    }
    if (joint.kind === "prismatic") {
      inner.add(tip(half, false));
      joint.bead = new THREE.Mesh(new THREE.TorusGeometry(4.5 * thin, 1.8 * thin, 14, 32), solid());
      inner.add(joint.bead);
    }
    if (joint.kind === "planar") {
      inner.add(new THREE.Mesh(sector(0, 1.6 * radius, 0, tau), flat(0.1)), tip(half, false));
    }
    joint.group = group;
    joint.inner = inner;
    joint.label = label(joint.name, style("--axis"));
    scene.add(group);
  }

  // Small beside its body, and visible beside all.
  let ballSize = data.ball;
  const seen = new Vector3();
  const update = () => {
    const at = Math.round(frame);
    viewAt(at, view);
    data.bodies.forEach((body, index) => {
      const visible = !hidden.has(index) && sighted(at);
      body.balls.visible = body.rods.visible = visible;
      body.trails.visible = !hidden.has(index) && byId("trails").checked;
      const middle = new Vector3();
      let count = 0;
      for (let feature = 0; feature < body.count; feature += 1) {
        const known = place(body, at, feature, point);
        if (known) middle.add(point.applyMatrix4(view)), count += 1;
        const size = known ? ballSize : 0;
        body.balls.setMatrixAt(feature, matrix.makeScale(size, size, size).setPosition(point));
      }
      body.balls.instanceMatrix.needsUpdate = true;
      const rods = body.rods.geometry.attributes.position;
      body.edges.forEach(([a, b], number) => {
        const both = place(body, at, a, point) && place(body, at, b, seen);
        if (both) { point.applyMatrix4(view); seen.applyMatrix4(view); }
        rods.setXYZ(2 * number, both ? point.x : 0, both ? point.y : 0, both ? point.z : 0);
        rods.setXYZ(2 * number + 1, both ? seen.x : 0, both ? seen.y : 0, both ? seen.z : 0);
      });
      rods.needsUpdate = true;
      body.label.visible = visible && count > 0;
      if (count) body.label.position.copy(middle.divideScalar(count)).addScaledVector(camera.up, ballSize * 2.5);
    });
    for (const joint of data.joints) {
      const shown = byId("joints").checked && !hidden.has(joint.moving);
      joint.group.visible = joint.label.visible = shown;
      poseOf(joint.reference, at, matrix);
      joint.group.matrix.multiplyMatrices(view, matrix);
      joint.label.position.set(...joint.point).addScaledVector(new Vector3(...(joint.direction ?? [0, 0, 0])), 1.08 * joint.half)
        .applyMatrix4(joint.group.matrix);
      const q = joint.positions.subarray(at * joint.freedoms, (at + 1) * joint.freedoms);
      const known = q.length > 0 && !Number.isNaN(q[0]);
      if (joint.needle) {
        joint.needle.visible = joint.done.visible = known;
        if (known) {
          joint.needle.rotation.z = q[0];
          joint.done.geometry.dispose();
          joint.done.geometry = sector(0, 0.86 * joint.radius, 0, Math.abs(q[0]) > tau ? q[0] % tau : q[0]);
          const along = joint.kind === "screw" ? joint.pitch * q[0] : joint.kind === "cylindrical" ? q[1] : 0;
          joint.needle.position.z = joint.done.position.z = along;
        }
      }
      if (joint.bead) {
        joint.bead.visible = known;
        if (known) joint.bead.position.z = q[0] - (joint.range[0][0] + joint.range[0][1]) / 2;
      }
    }
  };
  let wanted = false;
  const paint = () => {
    if (wanted) return;
    wanted = true;
    requestAnimationFrame(() => { wanted = false; renderer.render(scene, camera); });
  };
  draw = () => { update(); paint(); };

  const frameAll = () => {
    // What is seen of the bodies in these coordinates.
    const low = new Vector3(Infinity, Infinity, Infinity), high = low.clone().negate();
    const columns = [[], [], []];
    const stride = Math.max(1, Math.floor(frames / 120));
    const jointed = new Set(data.joints.flatMap(({ reference, moving }) => [reference, moving]));
    for (let at = 0; at < frames; at += stride) {
      if (!sighted(at)) continue;
      viewAt(at, view);
      for (const body of data.bodies.filter((_, index) => !jointed.size || jointed.has(index))) {
        for (let feature = 0; feature < body.count; feature += Math.max(1, body.count >> 4)) {
          if (place(body, at, feature, point)) point.applyMatrix4(view).toArray().forEach((x, axis) => columns[axis].push(x));
        }
      }
    }
    if (!columns[0].length) return;
    columns.forEach((column, axis) => {
      column.sort((a, b) => a - b);
      low.setComponent(axis, column[Math.floor(0.01 * (column.length - 1))]);
      high.setComponent(axis, column[Math.ceil(0.99 * (column.length - 1))]);
    });
    const centre = low.clone().add(high).divideScalar(2), size = Math.max(1e-6, low.distanceTo(high) / 2);
    ballSize = Math.min(Math.max(data.ball, 0.006 * size), 0.016 * size);
    const wide = Math.min(1, camera.aspect);
    controls.target.copy(centre);
    camera.position.copy(eye).multiplyScalar(0.92 * size / Math.tan(camera.fov * Math.PI / 360) / wide).add(centre);
    camera.near = size * 0.01;
    camera.far = size * 60;
    camera.updateProjectionMatrix();
    controls.update();
  };
  const eye = new Vector3(...data.eye);
  const ups = { "+x": [1, 0, 0], "−x": [-1, 0, 0], "+y": [0, 1, 0], "−y": [0, -1, 0], "+z": [0, 0, 1], "−z": [0, 0, -1] };
  const upSelect = byId("up");
  for (const name of Object.keys(ups)) {
    const chosen = ups[name].every((x, k) => x === data.up[k]);
    upSelect.add(new Option(name, name, chosen, chosen));
  }
  const stand = (name) => {
    const before = camera.up.clone();
    camera.up.set(...ups[name]);
    eye.applyQuaternion(new Quaternion().setFromUnitVectors(before, camera.up));
    // Orbits keep the up that they were made with.
    controls._quat?.setFromUnitVectors(camera.up, new Vector3(0, 1, 0));
    if (controls._quatInverse) controls._quatInverse.copy(controls._quat).invert();
  };
  camera.up.set(...data.up);
  stand(upSelect.value);
  upSelect.addEventListener("change", () => { stand(upSelect.value); frameAll(); draw(); });

  const from = byId("seen-from");
  from.add(new Option("the recording", "-1", viewer < 0, viewer < 0));
  data.bodies.forEach((body, index) => {
    if (posed(index)) from.add(new Option(body.name, index, viewer === index, viewer === index));
  });
  from.addEventListener("change", () => { viewer = +from.value; trails(); frameAll(); draw(); });
  for (const id of ["trails", "joints"]) byId(id).addEventListener("change", draw);
  data.bodies.forEach((body, index) => {
    const chip = document.createElement("button");
    chip.type = "button";
    chip.className = "chip";
    chip.setAttribute("aria-pressed", "true");
    const dot = document.createElement("i");
    dot.style.background = body.colour;
    const name = document.createElement("span");
    name.textContent = chip.title = body.name;
    chip.append(dot, name);
    chip.addEventListener("click", () => {
      hidden.has(index) ? hidden.delete(index) : hidden.add(index);
      chip.setAttribute("aria-pressed", String(!hidden.has(index)));
      draw();
    });
    byId("legend").append(chip);
  });

  let framed = false;
  const resize = () => {
    const { clientWidth: width, clientHeight: height } = stage;
    if (!width || !height) return;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    // Words are as high on every screen.
    const high = 2 * 15 * Math.tan(camera.fov * Math.PI / 360) / height * 1.5;
    for (const { label: sprite } of [...data.bodies, ...data.joints]) sprite.scale.set(high * sprite.userData.wide, high, 1);
    if (!framed) { frameAll(); framed = true; }
    paint();
  };
  new ResizeObserver(resize).observe(stage);
  resize();
  trails();
  // Bodies may come into sight later: the page opens where most are seen.
  let opening = 0, most = 0;
  for (let at = 0; at < frames; at += 1) {
    if (!sighted(at)) continue;
    const inSight = (body) => {
      for (let feature = 0; feature < body.count; feature += 1) if (place(body, at, feature, point)) return true;
      return false;
    };
    const count = data.bodies.filter(inSight).length;
    if (count > most) { most = count; opening = at; }
  }
  show(opening);

  // ---- What a test asks: how many pixels of axes are drawn, and whether the slider moves the picture.
  const pixels = () => {
    renderer.render(scene, camera);
    const gl = renderer.getContext(), { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
    const seen = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, seen);
    return seen;
  };
  window.jointscope = {
    check() {
      const differ = (a, b) => a.reduce((sum, x, k) => sum + (Math.abs(x - b[k]) > 24), 0);
      show(0);
      const start = pixels();
      byId("joints").click();
      const bare = pixels();
      byId("joints").click();
      slider.value = frames - 1;
      slider.dispatchEvent(new Event("input"));
      const end = pixels();
      return { frames, joints: data.joints.length, axes: differ(start, bare), moved: differ(start, end), moment: moments[0]?.path.getAttribute("transform") ?? null };
    },
  };
  document.documentElement.dataset.stage = "ready";
  if (location.hash === "#check") document.documentElement.dataset.check = JSON.stringify(window.jointscope.check());
  if (location.hash.startsWith("#frame=")) show(Math.round(+location.hash.slice(7) * (frames - 1)));
})();
