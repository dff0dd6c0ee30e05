"""Images that were not rendered: video files, folders of images, cameras, bags."""
