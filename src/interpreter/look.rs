//! Which of the show's views is looked from.

use super::{Call, Error, Interpreter, Reply};
use crate::lang::nearest;

impl Interpreter {
    /// The view that pictures are made from, by name; `None` when the show has none.
    pub fn view(&self) -> Option<&str> {
        self.show().view().map(|view| view.name.as_str())
    }

    /// Makes pictures from the view of this name from now on. Pictures from other views are kept.
    ///
    /// # Errors
    /// [`Error::Usage`] when there is no such view; as [`Interpreter::from_text`] when a file that
    /// the show names has become unreadable. Nothing has changed then.
    pub fn look_from(&mut self, name: &str) -> Result<(), Error> {
        let mut names = self.show().views.iter().map(|view| view.name.as_str());
        if !names.clone().any(|known| known == name) {
            let hint = match (nearest(name, names.clone()), names.next()) {
                (Some(near), _) => format!("did you mean `{near}`?"),
                (None, Some(_)) => "`view` lists those there are".to_owned(),
                (None, None) => "the show declares none: view house from … to … fov …".to_owned(),
            };
            return Err(Error::Usage(format!("there is no view `{name}`; {hint}")));
        }
        if self.view() == Some(name) {
            return Ok(());
        }
        let text = self.source.clone();
        self.compile_text(&text, Some(name.to_owned()))?;
        Ok(())
    }

    pub(super) fn answer_view(&mut self, call: &Call) -> Result<Reply, Error> {
        match call.words.as_slice() {
            [] => {}
            [name] => self.look_from(name)?,
            _ => return Err(Error::Usage("say one name: view stalls".to_owned())),
        }
        if self.show().views.is_empty() {
            return Ok(Reply::text("the show declares no view"));
        }
        let mut names: Vec<&str> = self.show().views.iter().map(|v| v.name.as_str()).collect();
        names.sort_unstable();
        let line = |name: &str| {
            let camera = self.show().views.iter().find(|v| v.name == name);
            let size = camera.map_or((0, 0), |v| (v.camera.width, v.camera.height));
            let mark = if self.view() == Some(name) { "*" } else { " " };
            format!("{mark} {name}  {}x{}\n", size.0, size.1)
        };
        Ok(Reply::text(names.into_iter().map(line).collect::<String>()))
    }
}
