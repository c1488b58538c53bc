"""A texture of 256x256 texels shown texel by pixel to both eyes (packages pyopenxr, PyOpenGL and glfw): each pixel reads one texel."""

import xr
import xr.utils.gl.glfw_util as glfw_util
from OpenGL import GL
from OpenGL.GL import shaders
from xr.utils.gl import ContextObject

VERTEX = """#version 410
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }"""
FRAGMENT = """#version 410
out vec4 color;
uniform sampler2D picture;
void main() { color = texelFetch(picture, ivec2(gl_FragCoord.xy) % 256, 0); }"""


def prepare():
    GL.glBindVertexArray(GL.glGenVertexArrays(1))
    compiled = [shaders.compileShader(text, kind) for text, kind in [(VERTEX, GL.GL_VERTEX_SHADER), (FRAGMENT, GL.GL_FRAGMENT_SHADER)]]
    GL.glUseProgram(shaders.compileProgram(*compiled))
    GL.glBindTexture(GL.GL_TEXTURE_2D, GL.glGenTextures(1))
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, GL.GL_RGBA8, 256, 256, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, bytes(range(256)) * 1024)
    for side in (GL.GL_TEXTURE_MIN_FILTER, GL.GL_TEXTURE_MAG_FILTER):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, side, GL.GL_NEAREST)


extensions = [xr.KHR_OPENGL_ENABLE_EXTENSION_NAME]
with ContextObject(
    instance_create_info=xr.InstanceCreateInfo(enabled_extension_names=extensions), context_provider=glfw_util.GLFWOffscreenContextProvider()
) as context:
    is_prepared = False
    for frame in context.frame_loop():
        for view in context.view_loop(frame):
            if not is_prepared:
                prepare()
                is_prepared = True
            GL.glDisable(GL.GL_DEPTH_TEST)
            GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
