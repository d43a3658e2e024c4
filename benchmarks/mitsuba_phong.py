"""The handout's Phong lobe as a BSDF of Mitsuba: f_r = Kd (n + 1)/(2π) max(0, ω_i·ω_r)^n, and its limit, a mirror."""

import drjit as dr
import mitsuba as mi


class PhongLobe(mi.BSDF):
    """Phong's lobe, drawn by its own density (n + 1)/(2π) (ω_i·ω_r)^n; from some n on, the direction ω_r alone.

    Its properties are ``Kd``, ``exponent`` and ``is_mirror``.
    """

    def __init__(self, properties) -> None:
        super().__init__(properties)
        self.colour, self.exponent = mi.Color3f(properties["Kd"]), float(properties["exponent"])
        self.is_mirror = bool(properties["is_mirror"])
        kind = mi.BSDFFlags.DeltaReflection if self.is_mirror else mi.BSDFFlags.GlossyReflection
        flags = kind | mi.BSDFFlags.FrontSide
        self.m_components, self.m_flags = [flags], flags

    def lobe(self, cosine):
        """(n + 1)/(2π) cosⁿ."""
        return (self.exponent + 1) / (2 * dr.pi) * dr.power(dr.maximum(cosine, 0), self.exponent)

    def sample(self, context, si, sample1, sample2, active=True):
        """A direction, and Kd max(0, n·ω_i)."""
        w_r = mi.reflect(si.wi)
        if self.is_mirror:
            w_o, pdf = w_r, mi.Float(1)
        else:
            cosine = dr.power(sample2.x, 1 / (self.exponent + 1))
            sine, azimuth = dr.safe_sqrt(1 - cosine * cosine), 2 * dr.pi * sample2.y
            w_o = mi.Frame3f(w_r).to_world(mi.Vector3f(sine * dr.cos(azimuth), sine * dr.sin(azimuth), cosine))
            pdf = self.lobe(cosine)
        cos_o = mi.Frame3f.cos_theta(w_o)
        active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (cos_o > 0)
        found = mi.BSDFSample3f()
        found.wo, found.pdf, found.eta = w_o, dr.select(active, pdf, 0), 1.0
        found.sampled_type, found.sampled_component = mi.UInt32(+self.m_flags), mi.UInt32(0)
        return found, dr.select(active, self.colour * cos_o, 0)

    def eval(self, context, si, wo, active=True):
        """f_r cos θ."""
        if self.is_mirror:
            return mi.Color3f(0)
        cos_o = mi.Frame3f.cos_theta(wo)
        active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (cos_o > 0)
        lobe = self.lobe(dr.dot(wo, mi.reflect(si.wi)))
        return dr.select(active, self.colour * lobe * cos_o, 0)

    def pdf(self, context, si, wo, active=True):
        """The density of ``sample``."""
        if self.is_mirror:
            return mi.Float(0)
        active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
        return dr.select(active, self.lobe(dr.dot(wo, mi.reflect(si.wi))), 0)

    def eval_pdf(self, context, si, wo, active=True):
        """Both."""
        return self.eval(context, si, wo, active), self.pdf(context, si, wo, active)

    def traverse(self, callback) -> None:
        """Nothing of it can be changed."""

    def to_string(self) -> str:
        """Its name."""
        return f"PhongLobe[{self.exponent:g}]"


PHONG = "handout_phong"
mi.register_bsdf(PHONG, PhongLobe)
