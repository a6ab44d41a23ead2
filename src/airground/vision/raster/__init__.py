"""Drawing kernels: warp, fill, blur, noise; for the renderer of the embedded world and for previews."""
