"""A tone curve: how the light of a picture becomes what a screen can show."""

import taichi_tracer as tt


@tt.register
class Mine(tt.Tone):
    """x (1 + x/w²) / (1 + x), where w becomes white (Reinhard et al., SIGGRAPH 2002, equation 4).

    x is linear light after the exposure; the result is linear light, too. Python calls the curve with a whole array,
    and kernels call it with a vec3: use + − × ÷ and powers, and no if.
    """

    name, white = "mine", 4.0

    def curve(self, x):
        """Linear light in [0, 1] for x in [0, white]: 0 stays 0, and it never decreases."""
        return x * (1 + x / self.white**2) / (1 + x)
