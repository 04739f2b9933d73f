;;; softmark-mode.el --- Scenes of softmark  -*- lexical-binding: t; -*-

;;; Commentary:

;; Colours for scenes, made of the vocabulary by `dsl editor emacs', and the language server `dsl lsp'.

;;; Code:

(defconst softmark-reserved '(@reserved@))
(defconst softmark-kinds '(@kinds@))
(defconst softmark-constructors '(@constructors@))
(defconst softmark-functions '(@functions@))
(defconst softmark-constants '(@constants@))
(defconst softmark-number "\\_<\\(\\(?:[0-9]+\\(?:\\.[0-9]+\\)?\\|\\.[0-9]+\\)\\(?:[eE][+-]?[0-9]+\\)?\\)")
(defconst softmark-unit "\\(?:%\\|°?[[:alpha:]][[:alnum:]]*\\)\\(?:\\^[-+]?[0-9]+\\)?")

(defconst softmark-font-lock
  `((,(concat "^[ \t]*" (regexp-opt softmark-kinds t) "[ \t]+\\([A-Za-z_][A-Za-z0-9_]*\\)[ \t]*=")
     (1 font-lock-type-face) (2 font-lock-variable-name-face))
    (,(regexp-opt softmark-reserved 'symbols) . font-lock-keyword-face)
    (,(concat (regexp-opt softmark-constructors 'symbols) "(") (1 font-lock-function-name-face))
    (,(concat (regexp-opt softmark-functions 'symbols) "(") (1 font-lock-builtin-face))
    ("\\_<\\([A-Za-z_][A-Za-z0-9_]*\\)[ \t]*=[^=]" (1 font-lock-variable-name-face))
    (,(concat softmark-number "\\(?:[ \t]*\\(" softmark-unit
              "\\(?:[*/·]\\(?:([^)\n]*)\\|" softmark-unit "\\)\\)*\\)\\)?")
     (1 font-lock-constant-face) (2 font-lock-type-face nil t))
    (,(concat "[])][ \t]*\\(" softmark-unit "\\)") (1 font-lock-type-face))
    (,(regexp-opt softmark-constants 'symbols) . font-lock-constant-face))
  "What has which colour.")

(defvar softmark-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?# "<" table)
    (modify-syntax-entry ?\n ">" table)
    (modify-syntax-entry ?_ "_" table)
    table)
  "Comments, texts and names.")

;;;###autoload
(define-derived-mode softmark-mode prog-mode "Scene"
  "Scenes of softmark."
  (setq-local comment-start "# ")
  (setq-local indent-line-function #'indent-relative)
  (setq-local font-lock-defaults '(softmark-font-lock)))

;;;###autoload
(add-to-list 'auto-mode-alist '("\\.scene\\'" . softmark-mode))

(defvar eglot-server-programs)
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '(softmark-mode . ("dsl" "lsp"))))

(provide 'softmark-mode)
;;; softmark-mode.el ends here
