"""Response, exposure, white balance and vignetting of 8-bit frames, from surface that several of them show."""
