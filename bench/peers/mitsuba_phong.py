"""Our glossy material for Mitsuba, which has no Phong: ρ_d/π + ρ_s·(n + 2)/(2π)·cosⁿα, α off the mirror direction.

Sampled by the lobes' mean albedos; two-sided. Needs a variant with just-in-time compilation.
"""

import drjit as dr
import mitsuba as mi

import scene as ours

KEPT = []
"""Mitsuba does not keep a Python object's methods alive."""


def load(material):
    """The BSDF of a scene.Material, for the variant in force."""
    if not mi.variant().startswith(("llvm", "cuda")):
        raise ours.SceneError(
            f"material {material.name!r}: Phong needs Mitsuba's llvm variant, {mi.variant()} is in use"
        )

    class Phong(mi.BSDF):
        def __init__(self, properties):
            super().__init__(properties)
            self.diffuse = mi.Color3f(*material.diffuse)
            self.specular = mi.Color3f(*material.specular)
            self.exponent = material.exponent
            self.share = sum(material.specular) / (sum(material.specular) + sum(material.diffuse))
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [flags]
            self.m_flags = flags

        def evaluate(self, wi, wo, active):
            """BRDF times cosine, and density; both directions on the upper side."""
            active = active & (wi.z > 0.0) & (wo.z > 0.0)
            cosine = dr.maximum(dr.dot(mi.Vector3f(-wi.x, -wi.y, wi.z), wo), 0.0)
            lobe = dr.inv_two_pi * dr.power(cosine, self.exponent)
            value = (self.diffuse * dr.inv_pi + self.specular * ((self.exponent + 2.0) * lobe)) * wo.z
            density = (1.0 - self.share) * dr.inv_pi * wo.z + self.share * (self.exponent + 1.0) * lobe
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def sample(self, context, si, sample1, sample2, active=True):
            side = dr.select(si.wi.z < 0.0, -1.0, 1.0)
            wi = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side)
            cosine = dr.power(sample2.x, 1.0 / (self.exponent + 1.0))
            sine, angle = dr.safe_sqrt(1.0 - cosine * cosine), 2.0 * dr.pi * sample2.y
            about = mi.Frame3f(mi.Vector3f(-wi.x, -wi.y, wi.z))
            glossy = about.to_world(mi.Vector3f(sine * dr.cos(angle), sine * dr.sin(angle), cosine))
            wo = dr.select(sample1 < self.share, glossy, mi.warp.square_to_cosine_hemisphere(sample2))
            value, density = self.evaluate(wi, wo, active)
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(wo.x, wo.y, wo.z * side)
            bs.pdf = density
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            bs.sampled_component = mi.UInt32(0)
            return bs, dr.select(density > 0.0, value / density, 0.0)

        def eval_pdf(self, context, si, wo, active=True):
            side = dr.select(si.wi.z < 0.0, -1.0, 1.0)
            upper = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side)
            return self.evaluate(upper, mi.Vector3f(wo.x, wo.y, wo.z * side), active)

        def eval(self, context, si, wo, active=True):
            return self.eval_pdf(context, si, wo, active)[0]

        def pdf(self, context, si, wo, active=True):
            return self.eval_pdf(context, si, wo, active)[1]

        def traverse(self, callback):
            pass

        def to_string(self):
            return f"Phong[{material.name}]"

    KEPT.append(Phong(mi.Properties()))
    return KEPT[-1]
