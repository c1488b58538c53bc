//! Head poses and HMD presets: from a scene's camera to the matrices of both eyes.
