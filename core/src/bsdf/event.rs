//! What a path does at a surface vertex.

/// A specular component of a scattering model: a law that gives the direction, with a probability
/// instead of a density. The number is the model's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Component(pub u8);

impl Component {
    /// Mirror reflection about n_s.
    pub const REFLECTION: Component = Component(0);
    /// Refraction at n_s, or straight on where there is no boundary.
    pub const TRANSMISSION: Component = Component(1);
}

/// What a path does at an inner vertex. "Specular" is said of such an event, never of a material:
/// one side of a surface may have components of both kinds.
///
/// Non-specular components are not told apart: f̄ and every density are sums over them. Specular
/// components are: each is a part of path space of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Event {
    /// A direction with a density. Connections end here.
    #[default]
    NonSpecular,
    /// The direction of a specular component.
    Specular(Component),
}

impl Event {
    /// True for [`Event::Specular`].
    #[inline]
    pub fn is_specular(self) -> bool {
        matches!(self, Event::Specular(_))
    }
}
