//! A plan held against the world it is for.

use super::ast::Keyword;
use super::check::Checker;
use crate::run::matches;

impl Checker<'_> {
    /// What must be in the workstation is in it.
    pub(super) fn against_world(&mut self) {
        let (Some(world), plan) = (self.world, self.plan) else {
            return;
        };
        let about = |name: &str| plan.about.iter().find(|field| field.name == name);
        if let (Some(field), Ok(workstation)) = (about("PlanWorkstation"), world.workstation())
            && field.value != workstation.name
        {
            let message = format!("the world is {}, not {}", workstation.name, field.value);
            self.error("plan::world", message, field.span);
        }
        if let Some(field) = about("TargetSKU")
            && world.design(&field.value).is_none()
        {
            let message = format!("the world has no kit design {}", field.value);
            self.error("plan::world", message, field.span);
        }
        for requirement in &plan.requirements {
            let place = requirement.location.unwrap_or(Keyword::Workstation);
            let skus = requirement.sku.iter().chain(&requirement.contents_type);
            skus.for_each(|sku| self.check_sku(sku, requirement.span));
            if !world
                .objects()
                .any(|object| matches(world, plan, requirement, object, place))
            {
                let message = format!("the world has nothing that meets {}", requirement.name);
                self.error("plan::world", message, requirement.span);
            }
        }
    }
}
