// After the emulator's own script: a headset that every page finds, whatever the browser has.
(() => {
  const settings = /* SETTINGS */ null;
  const device = new IWER.XRDevice(IWER.metaQuest3, {
    stereoEnabled: true,
    ipd: settings.ipd_m,
    fovy: settings.fovy,
  });
  device.installRuntime({ globalObject: globalThis, forceInstall: true });
  device.stereoEnabled = true;
  device.position.set(...settings.position);
  globalThis.parallaxHeadset = device;
})();
