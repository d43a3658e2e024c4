"""The teaching kit: assignments, what students check themselves, and what teachers grade."""
