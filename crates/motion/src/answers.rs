//! Answers that are kept.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::fmt;
use std::sync::Mutex;

/// Answers to questions about something, by their type.
#[derive(Default)]
pub(crate) struct Answers(Mutex<HashMap<TypeId, Box<dyn Any + Send + Sync>>>);

impl Answers {
    /// The answer of this type, asked for if it is not known yet.
    pub(crate) fn get_or_ask<T: Clone + Send + Sync + 'static>(&self, ask: impl FnOnce() -> T) -> T {
        let known = || self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(answer) = known().get(&TypeId::of::<T>()).and_then(|answer| answer.downcast_ref::<T>()) {
            return answer.clone();
        }
        // Not while others wait: answers may ask for more.
        let answer = ask();
        known().insert(TypeId::of::<T>(), Box::new(answer.clone()));
        answer
    }
}

/// A copy may come to differ, and is asked anew.
impl Clone for Answers {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Answers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Answers")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_asked_for_once_by_type_and_anew_by_a_copy() {
        let answers = Answers::default();
        let mut asked = 0;
        let mut ask = |answers: &Answers| {
            answers.get_or_ask(|| {
                asked += 1;
                asked
            })
        };
        assert_eq!([ask(&answers), ask(&answers), ask(&answers.clone())], [1, 1, 2]);
        assert_eq!(answers.get_or_ask(|| answers.get_or_ask(|| 1_i32).to_string()), "1");
    }
}
