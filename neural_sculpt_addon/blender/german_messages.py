# SPDX-License-Identifier: GPL-3.0-or-later
"""In German what is told while or after something happens: by operators, by the worker, by jobs.

A message may have been put together, each {} from something else, see `translations.translated`.
"""

MESSAGES = {
    # jobs
    "Add {}": "{} hinzufügen",
    "Export {}": "{} exportieren",
    "Fit {}": "{} anpassen",
    "Cleaning the mesh": "Mesh bereinigen",
    "Absorbing": "Übernehmen",
    "The field cannot hold all of {}: details finer than its finest level were left out. The proxy"
    " shows what it holds.": "Das Feld kann nicht alles von {} halten: Einzelheiten, die feiner als"
    " seine feinste Stufe sind, fehlen. Der Proxy zeigt, was es hält.",
    "A brushed part of the proxy is made of vertices and triangles.": "Ein bearbeiteter Teil des"
    " Proxys besteht aus Punkten und Dreiecken.",
    "Triangles of the brushed proxy name vertices that it does not have.": "Dreiecke des"
    " bearbeiteten Proxys nennen Punkte, die er nicht hat.",
    "Vertices of the brushed proxy have no finite position (NaN or infinite).": "Punkte des"
    " bearbeiteten Proxys haben keinen endlichen Ort (NaN oder unendlich).",
    "Fitting detail, level {}": "Details anpassen, Stufe {}",
    "Fitting, error {}": "Anpassen, Fehler {}",
    "Looking for the inside": "Das Innere suchen",
    "Looking for what was moved": "Suchen, was verschoben wurde",
    "Measuring": "Messen",
    "Measuring distances": "Abstände messen",
    "Measuring the field": "Feld vermessen",
    "Meshing": "Vernetzen",
    "Preparing": "Vorbereiten",
    "Sampling the field": "Feld abtasten",
    "Sculpting": "Modellieren",
    "Searching the surface": "Oberfläche suchen",
    "Snapping to the surface": "Auf die Oberfläche setzen",
    "Stroke {} of {}: {}": "Strich {} von {}: {}",
    "{} failed; the system console says why.": "{} ist fehlgeschlagen; die Systemkonsole sagt,"
    " warum.",
    "Waits until Dyntopo is off": "Wartet, bis Dyntopo ausgeschaltet ist",
    "Waits until Edit Mode is left": "Wartet, bis der Bearbeitungsmodus verlassen wird",
    "{} is sent to a new worker. {}": "{} wird einem neuen Arbeitsprozess gegeben. {}",
    "{} {} is in the history, muted.": "{} {} steht stummgeschaltet im Verlauf.",
    "The proxy was sculpted by other brushes meanwhile, so it was left as it is. Try again.": "Der"
    " Proxy wurde inzwischen mit anderen Pinseln modelliert und blieb deshalb, wie er ist. Noch"
    " einmal versuchen.",
    "The worker answered nonsense: {}": "Der Arbeitsprozess antwortete Unsinn: {}",
    "{} was dropped: the object is gone.": "{} wurde verworfen: Das Objekt ist nicht mehr da.",
    "{} was dropped: {} changed in the meantime.": "{} wurde verworfen: {} hat sich inzwischen"
    " geändert.",
    "{}: {} Nothing was changed.": "{}: {} Es wurde nichts geändert.",
    # objects
    "Dyntopo owns the mesh of {} while it is on. Turn it off to sculpt the field.": "Solange"
    " Dyntopo eingeschaltet ist, gehört ihm das Mesh von {}. Dyntopo ausschalten, um das Feld zu"
    " modellieren.",
    "{} has no faces. Choose a mesh with a closed surface.": "{} hat keine Flächen. Ein Mesh mit"
    " geschlossener Oberfläche wählen.",
    "{} has shape keys, which a new proxy would break. Remove them to sculpt.": "{} hat Shape-Keys,"
    " die ein neuer Proxy zerstören würde. Zum Modellieren entfernen.",
    "{} is in Edit Mode. Leave Edit Mode to sculpt the field.": "{} ist im Bearbeitungsmodus. Ihn"
    " verlassen, um das Feld zu modellieren.",
    "{} is linked from another file. Make it local to sculpt it.": "{} ist aus einer anderen Datei"
    " verknüpft. Zum Modellieren lokal machen.",
    "{} cannot be read ({}). The history of this field is damaged; Apply to Base keeps the field as"
    " it is and ends that.": "{} kann nicht gelesen werden ({}). Der Verlauf dieses Feldes ist"
    " beschädigt; Auf Grundlage anwenden behält das Feld, wie es ist, und beendet das.",
    # strokes
    "Preparing was dropped: the object is gone.": "Die Vorbereitung wurde verworfen: Das Objekt ist"
    " nicht mehr da.",
    "The worker sent no layer for {}. Try again.": "Der Arbeitsprozess hat für {} keine Ebene"
    " gesendet. Es noch einmal versuchen.",
    "The other object of the Boolean is gone. Select one again.": "Das andere Objekt des Boolean"
    " ist nicht mehr da. Erneut eines auswählen.",
    "The result would leave the box of the field. Join the two as meshes and make a new field of"
    " them (Neural Field from Mesh), or move the other object.": "Das Ergebnis würde den Würfel des"
    " Feldes verlassen. Beide als Mesh zusammenfügen und daraus ein neues Feld machen (Neuronales"
    " Feld aus Mesh) oder das andere Objekt verschieben.",
    "The other object is scaled to nothing. Give it a size.": "Das andere Objekt ist auf nichts"
    " skaliert. Ihm eine Größe geben.",
    "What was sculpted by other brushes is missing in the history.": "Was andere Pinsel modelliert"
    " haben, fehlt im Verlauf.",
    "The stroke covers more surface than one edit can hold. Use a smaller radius or fewer"
    " points.": "Der Strich bedeckt mehr Oberfläche, als eine Änderung halten kann. Einen kleineren"
    " Radius oder weniger Punkte verwenden.",
    "This field has detail, which only the solver local can sculpt. Consolidate it into a network"
    " first, or choose that solver.": "Dieses Feld hat Einzelheiten, die nur das Verfahren local"
    " modellieren kann. Es zuerst zu einem Netz verdichten oder dieses Verfahren wählen.",
    "{} was absorbed from other brushes and is no stroke. It can be muted, moved, weakened and"
    " deleted.": "{} wurde von anderen Pinseln aufgenommen und ist kein Strich. Es kann"
    " stummgeschaltet, verschoben, abgeschwächt und gelöscht werden.",
    "The field's weights are damaged. Undo the last change.": "Die Gewichte des Feldes sind"
    " beschädigt. Die letzte Änderung rückgängig machen.",
    "The sculpted proxy leaves the box of the field. Sculpt it back to within its size, or make a"
    " new field from it (Neural Field from Mesh).": "Der modellierte Proxy verlässt den Würfel des"
    " Feldes. Ihn wieder verkleinern oder ein neues Feld daraus machen (Neuronales Feld aus Mesh).",
    "The stroke has no width: its pressure is zero. Draw it again.": "Der Strich hat keine Breite:"
    " Sein Druck ist null. Noch einmal zeichnen.",
    "With its pressure the stroke has a radius of {}; the least is 0.001. Use a larger radius, or"
    " press harder.": "Mit seinem Druck hat der Strich einen Radius von {}; der kleinste ist 0,001."
    " Einen größeren Radius verwenden oder fester drücken.",
    "The stroke leaves nothing of the surface under it: its radius is too small, or its intensity"
    " so large that the surface runs through itself. Change one of them.": "Der Strich lässt nichts"
    " von der Oberfläche unter ihm übrig: Sein Radius ist zu klein oder seine Stärke so groß, dass"
    " die Oberfläche sich selbst durchdringt. Eines von beiden ändern.",
    "The stroke leaves the box [-1, 1]^3 of the field; draw on the surface.": "Der Strich verlässt"
    " den Würfel [-1, 1]^3 des Feldes; auf die Oberfläche zeichnen.",
    "The stroke leaves the surface between two of its points. Draw it with more points, or keep to"
    " one side of the shape.": "Der Strich verlässt zwischen zweien seiner Punkte die Oberfläche."
    " Mit mehr Punkten zeichnen oder auf einer Seite der Form bleiben.",
    "The stroke lies {} off the surface. Draw it on the proxy of this field.": "Der Strich liegt {}"
    " neben der Oberfläche. Auf den Proxy dieses Feldes zeichnen.",
    # meshes
    "A part of the mesh ({} of its area) is an open sheet, so it has no inside to sculpt. Give it a"
    " thickness, or close or delete it.": "Ein Teil des Meshs ({} seiner Fläche) ist eine offene"
    " Schale und hat kein Inneres zum Modellieren. Ihm eine Dicke geben, ihn schließen oder"
    " löschen.",
    "All faces of the mesh have zero area. Choose a mesh with a surface.": "Keine Fläche des Meshs"
    " hat einen Inhalt. Ein Mesh mit einer Oberfläche wählen.",
    "Some vertices of the mesh have no finite position (NaN or infinite). Delete them and try"
    " again.": "Einige Eckpunkte des Meshs haben keinen endlichen Ort (NaN oder unendlich). Sie"
    " löschen und es noch einmal versuchen.",
    "The mesh has no extent: all its vertices lie in one place.": "Das Mesh hat keine Ausdehnung:"
    " Alle seine Eckpunkte liegen an einem Ort.",
    "The mesh is an open sheet, so it has no inside to sculpt. Give it a thickness, or close or"
    " delete it.": "Das Mesh ist eine offene Schale und hat kein Inneres zum Modellieren. Ihm eine"
    " Dicke geben oder es schließen.",
    "The mesh is so far from its origin that its shape is lost in rounding. Move the mesh back to"
    " the object's origin.": "Das Mesh ist so weit von seinem Ursprung entfernt, dass seine Form"
    " beim Runden verloren geht. Es zum Ursprung des Objekts zurückschieben.",
    "The mesh is {} units large. Give it a sensible size and apply the scale.": "Das Mesh ist {}"
    " Einheiten groß. Ihm eine sinnvolle Größe geben und die Skalierung anwenden.",
    # files
    "A field cannot be exported as {}. Use one of {}.": "Ein Feld kann nicht als {} exportiert"
    " werden. Eines von {} verwenden.",
    "There is no file {}. Choose a .safetensors or .pth file.": "Es gibt keine Datei {}. Eine"
    " .safetensors- oder .pth-Datei wählen.",
    "There is no folder {}. Choose another place.": "Es gibt keinen Ordner {}. Einen anderen Ort"
    " wählen.",
    "{} cannot be written: {}. Choose another folder or file name.": "{} kann nicht geschrieben"
    " werden: {}. Einen anderen Ordner oder Dateinamen wählen.",
    "{} was not written ({}). Choose another folder or file name.": "{} wurde nicht geschrieben"
    " ({}). Einen anderen Ordner oder Dateinamen wählen.",
    "{} was not written: the object is gone.": "{} wurde nicht geschrieben: Das Objekt ist nicht"
    " mehr da.",
    "{} was not written: {}.": "{} wurde nicht geschrieben: {}.",
    # presets
    "A preset file has {} and nothing else.": "Eine Vorlagendatei enthält {} und sonst nichts.",
    "A preset has 2 to {} points.": "Eine Vorlage hat 2 bis {} Punkte.",
    "A preset is a {}, not {}.": "Eine Vorlage ist ein {}, nicht {}.",
    "A preset's name has 1 to {} printable characters.": "Der Name einer Vorlage hat 1 bis {}"
    " druckbare Zeichen.",
    "The points of a {} lie between {} and {}.": "Die Punkte von {} liegen zwischen {} und {}.",
    "The preset was not deleted ({}). Delete it by hand.": "Die Vorlage wurde nicht gelöscht ({})."
    " Sie von Hand löschen.",
    "The preset was not written ({}). Free some space.": "Die Vorlage wurde nicht geschrieben ({})."
    " Platz schaffen.",
    "This is no JSON preset file ({}).": "Das ist keine Vorlagendatei in JSON ({}).",
    "This preset cannot be read ({}).": "Diese Vorlage kann nicht gelesen werden ({}).",
    "This preset has version {}, this add-on reads version {}. Update Neural Sculpt.": "Diese"
    " Vorlage hat Version {}, dieses Add-on liest Version {}. Neural Sculpt aktualisieren.",
    "{} cannot be read ({}). Choose another file.": "{} kann nicht gelesen werden ({}). Eine andere"
    " Datei wählen.",
    # worker
    "Files of the worker could not be written. Stop the worker, check that the folder may be"
    " written, and try again.": "Dateien des Arbeitsprozesses konnten nicht geschrieben werden. Ihn"
    " anhalten, prüfen, ob in den Ordner geschrieben werden darf, und es noch einmal versuchen.",
    "Installing": "Installieren",
    "Looking which packages fit": "Passende Pakete suchen",
    "No Python here can hold the worker: {}. Name a Python that has PyTorch (in the preferences or"
    " as {}), or set PIP_EXTRA_INDEX_URL to an index with CPU builds of PyTorch and try"
    " again.": "Kein Python hier kann den Arbeitsprozess tragen: {}. Ein Python mit PyTorch nennen"
    " (in den Einstellungen oder als {}) oder PIP_EXTRA_INDEX_URL auf einen Index mit PyTorch"
    " für die CPU setzen und es noch einmal versuchen.",
    "Testing PyTorch": "PyTorch prüfen",
    "The disk is full. Free some gigabytes, or choose a folder on another disk, and try"
    " again.": "Die Platte ist voll. Einige Gigabyte freimachen oder einen Ordner auf einer"
    " anderen Platte wählen und es noch einmal versuchen.",
    "The disk of {} has {} GB left, the worker needs {} GB while it is installed. Free some, or"
    " choose another folder.": "Auf der Platte von {} sind noch {} GB frei, der Arbeitsprozess"
    " braucht {} GB, während er installiert wird. Platz schaffen oder einen anderen Ordner wählen.",
    "The installation stopped unexpectedly ({}). Try again, or see {}.": "Die Installation endete"
    " unerwartet ({}). Es noch einmal versuchen oder {} ansehen.",
    "The installation was cancelled.": "Die Installation wurde abgebrochen.",
    "The package index could not be reached safely. Check the clock, proxy and certificates of this"
    " computer, and try again.": "Der Paketindex war nicht sicher zu erreichen. Uhr, Proxy und"
    " Zertifikate dieses Rechners prüfen und es noch einmal versuchen.",
    "The package index could not be reached. Check the network and the proxy, and try again.": "Der"
    " Paketindex war nicht zu erreichen. Netz und Proxy prüfen und es noch einmal versuchen.",
    "The worker is installed": "Der Arbeitsprozess ist installiert",
    "The worker was installed but {}; see {}, or choose another Python.": "Der Arbeitsprozess wurde"
    " installiert, aber {}; siehe {} oder ein anderes Python wählen.",
    "There is no Python {} or newer here for the worker; install one from python.org and try"
    " again.": "Hier gibt es kein Python {} oder neuer für den Arbeitsprozess; eines von python.org"
    " installieren und es noch einmal versuchen.",
    "Trying Python {} ({})": "Python {} versuchen ({})",
    "{} already holds other files; choose an empty folder for the worker.": "{} enthält schon"
    " andere Dateien; einen leeren Ordner für den Arbeitsprozess wählen.",
    "The graphics card cannot be used ({}). Choose another device in the preferences.": "Die"
    " Grafikkarte kann nicht verwendet werden ({}). Ein anderes Gerät in den Einstellungen wählen.",
    "The worker cannot be started ({}); check its Python in the preferences.": "Der Arbeitsprozess"
    " kann nicht gestartet werden ({}); sein Python in den Einstellungen prüfen.",
    "The worker is not installed; install it in the add-on's preferences.": "Der Arbeitsprozess ist"
    " nicht installiert; ihn in den Einstellungen des Add-ons installieren.",
    "The worker stopped unexpectedly ({}). Nothing in Blender is lost; see {}.": "Der"
    " Arbeitsprozess endete unerwartet ({}). In Blender ist nichts verloren; siehe {}.",
    "The worker's PyTorch sees no CUDA graphics card. Choose another device in the preferences, or"
    " a Worker Python whose PyTorch is made for CUDA.": "Das PyTorch des Arbeitsprozesses sieht"
    " keine CUDA-Grafikkarte. Ein anderes Gerät in den Einstellungen wählen oder ein Python mit"
    " einem PyTorch für CUDA.",
    "There is no Python at {}; correct the path.": "Es gibt kein Python unter {}; den Pfad"
    " berichtigen.",
    # files and meshes from outside
    "The field has no surface in its box. Undo the last stroke or choose another model.": "Das Feld"
    " hat in seinem Kasten keine Oberfläche. Den letzten Strich zurücknehmen oder ein anderes"
    " Modell wählen.",
    "This safetensors file holds no neural field of Neural Sculpt.": "Diese safetensors-Datei"
    " enthält kein neuronales Feld von Neural Sculpt.",
    "This field was written in format version {}, this add-on reads version {}. Update Neural"
    " Sculpt to open it.": "Dieses Feld hat die Formatversion {}, dieses Add-on liest Version {}."
    " Neural Sculpt aktualisieren, um es zu öffnen.",
    "{} is no field file; choose a .safetensors or .pth file.": "{} ist keine Felddatei; eine"
    " .safetensors- oder .pth-Datei wählen.",
    "This checkpoint unpacks to more than any field file (256 MiB).": "Dieser Checkpoint ist"
    " entpackt größer als jede Felddatei (256 MiB).",
    "The .pth format has no place for detail. Save as .safetensors, sculpt with --solver network,"
    " or choose Consolidate, which fits a plain network to the field.": "Das Format .pth hat keinen"
    " Platz für Einzelheiten. Als .safetensors speichern, mit --solver network modellieren oder"
    " Verdichten wählen, das ein Netz ohne Einzelheiten an das Feld anpasst.",
    "This field file lacks its detail; it is damaged.": "Dieser Felddatei fehlen ihre Einzelheiten;"
    " sie ist beschädigt.",
    "The .pth format has one omega for all inner layers; save as .safetensors instead.": "Das"
    " Format .pth hat ein Omega für alle inneren Schichten; stattdessen als .safetensors"
    " speichern.",
    "This network has {} layers; a field has 2 to {}.": "Dieses Netz hat {} Schichten; ein Feld hat"
    " 2 bis {}.",
    "This network's omega factors do not fit its layers.": "Die Omega-Faktoren dieses Netzes passen"
    " nicht zu seinen Schichten.",
    "This network's weights hold NaN or infinite numbers; it is damaged.": "Die Gewichte dieses"
    " Netzes enthalten NaN oder unendliche Zahlen; es ist beschädigt.",
    "This is no readable safetensors file; it is damaged.": "Dies ist keine lesbare"
    " safetensors-Datei; sie ist beschädigt.",
    "This field file lacks a part of the network; it is damaged.": "Dieser Felddatei fehlt ein Teil"
    " des Netzes; sie ist beschädigt.",
    "{} is larger than any field file (256 MiB).": "{} ist größer als jede Felddatei (256 MiB).",
    "This is no intact checkpoint of plain weights; nothing in it was executed.": "Dies ist kein"
    " heiler Checkpoint aus bloßen Gewichten; nichts darin wurde ausgeführt.",
    "This checkpoint holds no SIREN network of the authors' form.": "Dieser Checkpoint enthält kein"
    " SIREN-Netz in der Form der Autoren.",
    "This checkpoint is truncated or damaged.": "Dieser Checkpoint ist abgeschnitten oder"
    " beschädigt.",
    "This network's weights are no floating-point tensors.": "Die Gewichte dieses Netzes sind keine"
    " Gleitkomma-Tensoren.",
    "This network's weights are no plain tensors; save them densely.": "Die Gewichte dieses Netzes"
    " sind keine einfachen Tensoren; sie dicht speichern.",
    "This network's weights take more than any field's (256 MiB).": "Die Gewichte dieses Netzes"
    " sind größer als die jedes Feldes (256 MiB).",
    "This network's layer {} has weights {} and biases {}; a field leads from 3 coordinates to 1"
    " value.": "Schicht {} dieses Netzes hat die Gewichte {} und Biase {}; ein Feld führt von 3"
    " Koordinaten zu 1 Wert.",
    "The mesh has no faces. Choose an object with a surface.": "Das Mesh hat keine Flächen. Ein"
    " Objekt mit einer Oberfläche wählen.",
    "The worker is not running; start it again.": "Der Arbeitsprozess läuft nicht; ihn neu"
    " starten.",
}
