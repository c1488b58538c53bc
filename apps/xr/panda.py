"""A model of Panda3D in OpenXR (packages panda3d and panda3d-openxr)."""

from direct.showbase.ShowBase import ShowBase
from panda3d.core import loadPrcFileData
from p3dopenxr.p3dopenxr import P3DOpenXR

loadPrcFileData("", "audio-library-name null")
base = ShowBase()
openxr = P3DOpenXR()
openxr.init()
model = base.loader.load_model("panda")
model.reparent_to(base.render)
model.set_pos(0, 10, -5)
base.run()
