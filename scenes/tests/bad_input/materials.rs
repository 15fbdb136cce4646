//! Scattering models, emitters and integrators.

use super::{bsdf, check, scene, shape};

#[test]
fn broken_materials_and_lights() {
    check(&[
        (
            bsdf("bakelite\">"),
            vec![],
            "bad.xml:3: bsdf type \"bakelite\" is not understood; known: blendbsdf, bumpmap, coating, conductor, dielectric, difftrans, diffuse, mask, mixturebsdf, normalmap, null, phong, plastic, principled, principledthin, roughcoating, roughconductor, roughdielectric, roughdiffuse, roughplastic, thindielectric, twosided, ward",
        ),
        (
            bsdf("mask\"><float name=\"opacity\" value=\"0.5\"/>"),
            vec![],
            "bad.xml:3: bsdf \"mask\": needs 1 nested <bsdf>, not 0",
        ),
        (
            bsdf("blendbsdf\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/>"),
            vec![],
            "bad.xml:3: bsdf \"blendbsdf\": needs the property \"weight\"",
        ),
        (
            bsdf("normalmap\"><bsdf type=\"diffuse\"/>"),
            vec![],
            "bad.xml:3: bsdf \"normalmap\": needs a nested texture",
        ),
        (
            bsdf("principled\"><float name=\"metallic\" value=\"2\"/>"),
            vec![],
            "bad.xml:3: bsdf \"principled\": property \"metallic\": \"2\" is not a colour with components from 0 to 1",
        ),
        (
            bsdf(
                "roughdielectric\"><float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" value=\"1.5\"/>",
            ),
            vec![],
            "bad.xml:3: bsdf \"roughdielectric\": needs different \"int_ior\" and \"ext_ior\"",
        ),
        (
            bsdf("twosided\"><bsdf type=\"mask\"><bsdf type=\"diffuse\"/></bsdf>"),
            vec![],
            "bad.xml:3: bsdf \"mask\" lets light through and cannot be twosided",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"1.5, 0, 0\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"1.5, 0, 0\" is not a colour with components from 0 to 1",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"-0.1\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"-0.1, -0.1, -0.1\" is not a colour with components from 0 to 1",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"#12345\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"#12345\" is not a colour such as #ff8000",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"0.1, 0.2\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"0.1, 0.2\" is not one or three numbers",
        ),
        (
            bsdf("diffuse\"><spectrum name=\"reflectance\" value=\"400:0.1, 300:0.9\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"400, 300\" is not a list of rising wavelengths",
        ),
        (
            bsdf("diffuse\"><texture name=\"reflectance\" type=\"bitmap\"/>"),
            vec![],
            "bad.xml:3: texture \"bitmap\": needs the property \"filename\"",
        ),
        (
            bsdf("dielectric\"><string name=\"int_ior\" value=\"jelly\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\": property \"int_ior\": \"jelly\" is not a number or one of vacuum, helium, hydrogen, air, carbon dioxide, water ice, water, acetone, ethanol, fused quartz, carbon tetrachloride, pyrex, glycerol, acrylic glass, polypropylene, benzene, bk7, silicone oil, sodium chloride, amber, pet, bromine, diamond",
        ),
        (
            bsdf("dielectric\"><float name=\"int_ior\" value=\"0\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\": property \"int_ior\": \"0\" is not a number > 0",
        ),
        (
            bsdf("conductor\"><string name=\"material\" value=\"Xx\"/>"),
            vec![],
            "bad.xml:3: bsdf \"conductor\": property \"material\": \"Xx\" is not one of Ag, Al, AlAs, AlAs_palik, AlSb, AlSb_palik, Au, Be, Be_palik, Cr, CsI, CsI_palik, Cu, Cu2O, Cu2O_palik, CuO, CuO_palik, Cu_palik, Hg, HgTe, HgTe_palik, Hg_palik, Ir, Ir_palik, K, K_palik, Li, Li_palik, MgO, MgO_palik, Mo, Mo_palik, Na_palik, Nb, Nb_palik, Ni_palik, Rh, Rh_palik, Se, Se-e, Se-e_palik, Se_palik, SiC, SiC_palik, SnTe, SnTe_palik, Ta, Ta_palik, Te, Te-e, Te-e_palik, Te_palik, ThF4, ThF4_palik, TiC, TiC_palik, TiN, TiN_palik, TiO2, TiO2-e, TiO2-e_palik, TiO2_palik, VC, VC_palik, VN, VN_palik, V_palik, W, a-C, d-C, d-C_palik, none (or give eta and k)",
        ),
        (
            bsdf(
                "conductor\"><string name=\"material\" value=\"Au\"/><rgb name=\"k\" value=\"1\"/>",
            ),
            vec![],
            "bad.xml:3: bsdf \"conductor\": has \"material\" and \"eta\" or \"k\": give one or the other",
        ),
        (
            bsdf("roughconductor\"><float name=\"alpha\" value=\"-0.5\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": property \"alpha\": \"-0.5\" is not a number ≥ 0",
        ),
        (
            bsdf("roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": has only one of \"alpha_u\" and \"alpha_v\"",
        ),
        (
            bsdf("roughconductor\"><string name=\"distribution\" value=\"phong\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": property \"distribution\": \"phong\" is not one of beckmann, ggx",
        ),
        (
            bsdf("twosided\">"),
            vec![],
            "bad.xml:3: bsdf \"twosided\": needs one or two nested <bsdf>, not 0",
        ),
        (
            bsdf("twosided\"><bsdf type=\"dielectric\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\" lets light through and cannot be twosided",
        ),
        (
            shape("<bsdf type=\"diffuse\"/>\n<bsdf type=\"diffuse\"/>"),
            vec![],
            "bad.xml:5: shape \"sphere\" has more than one <bsdf>",
        ),
        (
            shape("<emitter type=\"point\"/>"),
            vec![],
            "bad.xml:4: emitter \"point\" cannot stand in a shape, only \"area\"",
        ),
        (
            shape("<emitter type=\"area\"><rgb name=\"radiance\" value=\"-1\"/></emitter>"),
            vec![],
            "bad.xml:4: emitter \"area\": property \"radiance\": \"-1, -1, -1\" is not a colour without negative components",
        ),
        (
            shape("<emitter type=\"area\"/>\n<emitter type=\"area\"/>"),
            vec![],
            "bad.xml:5: shape \"sphere\" has more than one <emitter>",
        ),
        (
            scene("<emitter type=\"laser\"/>"),
            vec![],
            "bad.xml:3: emitter type \"laser\" is not understood; known: area, constant, directional, envmap, point, projector, sky, spot, sun, sunsky",
        ),
        (
            scene(
                "<emitter type=\"directional\"><vector name=\"direction\" value=\"0\"/></emitter>",
            ),
            vec![],
            "bad.xml:3: emitter \"directional\": property \"direction\": \"0, 0, 0\" is not a direction other than 0, 0, 0",
        ),
        (
            scene("<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>"),
            vec![],
            "bad.xml:4: more than one environment emitter",
        ),
        (
            scene(
                "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>",
            ),
            vec![],
            "bad.xml:3: integrator \"path\": property \"max_depth\": \"-2\" is not -1 (unlimited) or an integer from 0 to 16777216",
        ),
        (
            scene("<integrator type=\"path\"/>\n<integrator type=\"path\"/>"),
            vec![],
            "bad.xml:4: <scene> has more than one <integrator>",
        ),
    ]);
}
