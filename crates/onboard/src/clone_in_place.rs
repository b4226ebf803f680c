//! Copying without allocation, where what is copied over has the same shape.

/// Implements [`Clone`] field by field, and [`Clone::clone_from`] too: what a derive leaves out.
macro_rules! clone_in_place {
    ($type:ident { $($field:ident),+ }) => {
        impl Clone for $type {
            fn clone(&self) -> Self {
                Self { $($field: self.$field.clone()),+ }
            }

            fn clone_from(&mut self, source: &Self) {
                $(self.$field.clone_from(&source.$field);)+
            }
        }
    };
}
pub(crate) use clone_in_place;
