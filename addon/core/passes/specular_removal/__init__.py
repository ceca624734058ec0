"""The specular part of every observation, predicted from the fitted lobes and taken out before the median."""
