# SPDX-License-Identifier: GPL-3.0-or-later
"""Take any image as the alpha of the brush: a file, or an image of this scene."""

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, Event, Image, Operator
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....stroke.alpha import Alpha, pixels_of
from ...presets.alpha_choices import IMAGE
from ...scene.brush.brush_properties import brush_of
from ..job_operator import FINISHED, REGISTER, Outcome, reports_errors

MOST_PIXELS = 4096 * 4096  # pixels: half a second, and 300 MB meanwhile
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of red, green and blue


class NEURAL_SCULPT_OT_alpha_image(Operator):
    """Take an image as the alpha of the brush: white is high, black and transparent are flat"""

    bl_idname = "neural_sculpt.alpha_image"
    bl_label = "Alpha from Image"
    bl_options = REGISTER

    filepath: StringProperty(
        name="File", description="Of an image", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    image: StringProperty(
        name="Image", description="Of this scene, instead of a file", options={"SKIP_SAVE"}
    )
    filter_image: BoolProperty(default=True, options={"HIDDEN"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file if no image is named."""
        if self.image:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Reduce the image to the pixels of an alpha, and choose that."""
        if self.image:
            if (image := bpy.data.images.get(self.image)) is None:
                raise SculptError("There is no image {}. Choose another one.", f"{self.image:.100}")
            grey = _grey(image)
        else:
            grey = _grey_of_file(bpy.path.abspath(self.filepath))
        brush = brush_of(context)
        brush.alpha_pixels = Alpha(pixels=pixels_of(grey)).to_json()["pixels"]
        brush.alpha = IMAGE
        return FINISHED


def _grey_of_file(path: str) -> NDArray[np.float32]:
    """Grey values (H, W) of an image file. No data-block of it stays in the scene."""
    try:
        image = bpy.data.images.load(path, check_existing=False)
    except RuntimeError as error:
        reason = str(error).removeprefix("Error: ").strip()
        raise SculptError(
            "The image cannot be read ({}). Choose another one.", f"{reason:.200}"
        ) from error
    try:
        return _grey(image)
    finally:
        bpy.data.images.remove(image)


def _grey(image: Image) -> NDArray[np.float32]:
    """Grey values (H, W), the first row on top: luminance, times alpha where the image has it."""
    width, height = image.size  # pyright: ignore[reportGeneralTypeIssues]
    if not width * height * image.channels:
        raise SculptError("{} has no pixels. Choose another image.", f"{image.name:.100}")
    if width * height > MOST_PIXELS:
        raise SculptError(
            "{} has {} x {} pixels, more than an alpha can use. Scale it down to 4096 x 4096.",
            f"{image.name:.100}",
            width,
            height,
        )
    flat = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(flat)  # pyright: ignore[reportAttributeAccessIssue]
    pixels = flat.reshape(height, width, image.channels)[::-1]
    grey = pixels[..., :3] @ LUMINANCE if image.channels >= 3 else pixels[..., 0]
    return grey * pixels[..., 3] if image.channels == 4 else grey
