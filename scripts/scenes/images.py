"""Image files of a converted scene, in its folder `textures`. Needs Pillow for the first one."""

import shutil

# Opaque PNG files up to this many pixels stay PNG.
SMALL = 128 * 128
# As Pillow numbers the filter.
LANCZOS = 1


class Images:
    def __init__(self, folder, limit=None):
        self.folder = folder / "textures"
        self.folder.mkdir()
        self.limit = limit
        self.made = {}

    def uri(self, source, alpha=False):
        """The image `source` within the size limit: as it is, a PNG if `alpha` is needed and there, or else a JPEG."""
        key = (source, alpha)
        if key not in self.made:
            from PIL import Image

            with Image.open(source) as image:
                self.made[key] = self.convert(image, source, alpha)
        return self.made[key]

    def convert(self, image, source, alpha):
        transparent = "A" in image.mode or "transparency" in image.info
        full, unchanged = image.size, image.mode in ("RGB", "RGBA")
        if not unchanged:
            image = image.convert("RGBA" if transparent else "RGB")
        if self.limit and max(full) > self.limit:
            size = [max(1, round(side * self.limit / max(full))) for side in full]
            image = image.resize(size, LANCZOS)
            unchanged = False
        jpeg = source.suffix.lower() in (".jpg", ".jpeg")
        small = image.width * image.height <= SMALL
        if not jpeg and not (alpha and transparent) and not small:
            return self.save(image.convert("RGB"), f"{source.stem}.jpg", "j", quality=88, optimize=True)
        if jpeg and image.size != full:
            return self.save(image.convert("RGB"), source.name, quality=90)
        if jpeg or unchanged:
            path = self.free(source.name)
            shutil.copyfile(source, path)
            return f"textures/{path.name}"
        return self.save(image, source.name, optimize=True)

    def save(self, image, name, mark="1", **options):
        path = self.free(name, mark)
        image.save(path, **options)
        return f"textures/{path.name}"

    def once(self, name, make, **options):
        """The image that `make` returns, made and saved the first time that its name is asked for."""
        if name not in self.made:
            self.made[name] = self.save(make(), name, **options)
        return self.made[name]

    def free(self, name, mark="1"):
        """A path of that name; with marks before it as long as another folder's image has the name already."""
        while (self.folder / name).exists():
            name = f"{mark}_{name}"
        return self.folder / name
