// Put into a page before its own scripts: a clock, a random generator and animation frames that are told from outside, so
// that every run draws the same pictures.
(() => {
  const settings = /* SETTINGS */ null;
  const real = performance.now.bind(performance);
  const state = { now: 0, callbacks: new Map(), next: 1, contexts: [], errors: [], views: [] };
  const counts = { refused: 0, handed_over: 0, workers: 0, webgpu: 0 };

  // mulberry32
  let seed = settings.seed >>> 0;
  Math.random = () => {
    seed = (seed + 0x6d2b79f5) >>> 0;
    let t = seed;
    t = Math.imul(t ^ (t >>> 15), t | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };

  performance.now = () => state.now;
  const RealDate = Date;
  const now = () => settings.epoch_ms + Math.floor(state.now);
  globalThis.Date = class extends RealDate {
    constructor(...of) {
      if (of.length === 0) super(now());
      else super(...of);
    }
    static now() {
      return now();
    }
  };

  globalThis.requestAnimationFrame = (callback) => {
    const id = state.next++;
    state.callbacks.set(id, callback);
    return id;
  };
  globalThis.cancelAnimationFrame = (id) => state.callbacks.delete(id);

  for (const canvas of [HTMLCanvasElement, globalThis.OffscreenCanvas]) {
    if (!canvas) continue;
    const original = canvas.prototype.getContext;
    canvas.prototype.getContext = function (kind, ...rest) {
      const context = original.call(this, kind, ...rest);
      const webgl = /webgl/.test(kind);
      if (context && webgl && !state.contexts.includes(context)) state.contexts.push(context);
      if (!context && webgl) counts.refused++;
      if (context && kind === "webgpu") counts.webgpu++;
      return context;
    };
  }
  const handOver = HTMLCanvasElement.prototype.transferControlToOffscreen;
  if (handOver) {
    HTMLCanvasElement.prototype.transferControlToOffscreen = function () {
      counts.handed_over++;
      return handOver.call(this);
    };
  }
  if (globalThis.Worker) {
    globalThis.Worker = class extends Worker {
      constructor(...of) {
        super(...of);
        counts.workers++;
      }
    };
  }

  // Waits until everything that a context was told has been done.
  const finish = (gl) => {
    const gl2 = typeof WebGL2RenderingContext !== "undefined" && gl instanceof WebGL2RenderingContext;
    const target = gl2 ? gl.READ_FRAMEBUFFER : gl.FRAMEBUFFER;
    const bound = gl.getParameter(gl2 ? gl.READ_FRAMEBUFFER_BINDING : gl.FRAMEBUFFER_BINDING);
    const buffer = gl2 ? gl.getParameter(gl.PIXEL_PACK_BUFFER_BINDING) : null;
    if (buffer) gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.bindFramebuffer(target, null);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    gl.bindFramebuffer(target, bound);
    if (buffer) gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
  };

  const noteViews = () => {
    if (!globalThis.XRFrame || XRFrame.prototype.parallaxNotes) return;
    XRFrame.prototype.parallaxNotes = true;
    const original = XRFrame.prototype.getViewerPose;
    XRFrame.prototype.getViewerPose = function (space) {
      const pose = original.call(this, space);
      if (pose && pose.views.length === 2) {
        state.views = pose.views.map((view) => ({
          eye: view.eye,
          projection: [...view.projectionMatrix],
          world_to_eye: [...view.transform.inverse.matrix],
          position: ["x", "y", "z"].map((axis) => view.transform.position[axis]),
        }));
      }
      return pose;
    };
  };

  addEventListener("error", (event) => state.errors.push(String(event.message)));
  addEventListener("unhandledrejection", (event) => state.errors.push(String(event.reason)));

  globalThis.parallax = {
    // Draws a frame; tells how long it took and what it was drawn for.
    async step(time_ms, picture) {
      state.now = time_ms;
      const due = [...state.callbacks.values()];
      state.callbacks.clear();
      state.views = [];
      noteViews();
      const start = real();
      for (const callback of due) {
        try {
          callback(time_ms);
        } catch (error) {
          state.errors.push(String((error && error.stack) || error));
        }
      }
      let shown = null;
      const largest = state.contexts
        .filter((gl) => gl.canvas instanceof HTMLCanvasElement)
        .sort((a, b) => b.canvas.width * b.canvas.height - a.canvas.width * a.canvas.height)[0];
      if (picture && largest) shown = largest.canvas.toDataURL("image/png");
      for (const gl of state.contexts) finish(gl);
      const took_ms = real() - start;
      const errors = state.errors.splice(0);
      const lost = state.contexts.filter((gl) => gl.isContextLost()).length;
      return { callbacks: due.length, took_ms, errors, lost, views: state.views, picture: shown };
    },
    // The page's contexts, and what its pictures are drawn with.
    contexts() {
      const renderers = state.contexts.map((gl) => {
        const more = gl.getExtension("WEBGL_debug_renderer_info");
        return String(gl.getParameter(more ? more.UNMASKED_RENDERER_WEBGL : gl.RENDERER) ?? "a lost context");
      });
      return { renderers, ...counts };
    },
  };
})();
